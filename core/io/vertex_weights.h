#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace crease {

/// The largest weight of the likelihood for a vertex. The smallest is 0.
inline constexpr double kMaxWeight = 1e6;

/// Whether a weight is in the range; false for NaN.
inline bool is_weight(double weight) { return weight >= 0 && weight <= kMaxWeight; }

/// Refuses the weight of `vertex`. \throw Error weights_invalid, always
[[noreturn]] void fail_weight(std::size_t vertex, double weight, std::string place = {});

/// Reads a JSON array with one weight for each of `vertices` vertices from untrusted text. Stops at the first fault, so
/// that it never holds more weights than that.
/// \throw Error weights_invalid with the first faulty item as `field`, or with the byte as place
std::vector<double> read_weights(std::string_view json, std::size_t vertices);

}  // namespace crease
