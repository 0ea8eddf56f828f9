#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

namespace crease {

/// For each of the shares, from 0 to 1 and ascending, the one of `values` that this share of the others is below; 0 for
/// none.
template <typename Value, std::size_t count>
std::array<double, count> quantiles(std::vector<Value> values, const std::array<double, count>& shares) {
  std::array<double, count> found{};
  if (values.empty()) return found;
  auto first = values.begin();  // none before it is above any from it on
  for (std::size_t k = 0; k < count; ++k) {
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(shares[k] * static_cast<double>(values.size() - 1));
    std::ranges::nth_element(first, place, values.end());
    found[k] = static_cast<double>(*place);
    first = place;
  }
  return found;
}

/// The same for one share.
template <typename Value>
double quantile(std::vector<Value> values, double share) {
  return quantiles(std::move(values), std::array{share})[0];
}

}  // namespace crease
