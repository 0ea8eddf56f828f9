#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace crease {

/// The largest weight of the likelihood that a vertex may have; the smallest is 0.
inline constexpr double kMaxWeight = 1e6;

/// False for NaN.
inline bool is_weight(double weight) { return weight >= 0 && weight <= kMaxWeight; }

/// \throw Error weights_invalid, always: the weight of `vertex` is none
[[noreturn]] void fail_weight(std::size_t vertex, double weight, std::string place = {});

/// A JSON array with a weight for each of `vertices` vertices, from untrusted text. Holds no more than that.
/// \throw Error weights_invalid, with the first item that is none as `field`, or the byte as place
std::vector<double> read_weights(std::string_view json, std::size_t vertices);

}  // namespace crease
