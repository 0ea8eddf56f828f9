#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace crease {

/// The one of `values` that a share from 0 to 1 of the others is below; 0 for none.
template <typename Value>
double quantile(std::vector<Value> values, double share) {
  if (values.empty()) return 0;
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, place);
  return static_cast<double>(*place);
}

}  // namespace crease
