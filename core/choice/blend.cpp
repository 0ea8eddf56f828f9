#include "core/choice/blend.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace crease {

std::vector<double> weights_of_risks(std::vector<std::vector<float>>& risks) {
  constexpr float kTemperature = 0.03F;  // noise variances
  const std::size_t count = risks.front().size();
  std::vector<double> shares(risks.size(), 0);
  for (std::size_t v = 0; v < count; ++v) {
    float lowest = std::numeric_limits<float>::infinity(), sum = 0;
    for (const auto& risk : risks) lowest = std::min(lowest, risk[v]);
    for (auto& risk : risks) sum += risk[v] = std::exp((lowest - risk[v]) / kTemperature);
    for (std::size_t j = 0; j < risks.size(); ++j) {
      risks[j][v] /= sum;
      shares[j] += static_cast<double>(risks[j][v]) / static_cast<double>(count);
    }
  }
  return shares;
}

FlatVectors blended(const std::vector<FlatVectors>& results, const std::vector<std::vector<float>>& weights) {
  FlatVectors sum(results.front().size(), 0);
  const std::size_t count = sum.size() / 3;
  for (std::size_t j = 0; j < results.size(); ++j) {
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += weights[j][i % count] * results[j][i];
  }
  return sum;
}

}  // namespace crease
