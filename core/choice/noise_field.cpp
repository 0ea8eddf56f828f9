#include "core/choice/noise_field.h"

#include <algorithm>
#include <cmath>

namespace crease {
namespace {

constexpr int kRounds = 40;
constexpr float kLargestSquare = 9;  ///< of a residual, in variances

}  // namespace

std::vector<float> NoiseField::precisions() const {
  std::vector<float> result;
  result.reserve(variances.size());
  for (const float variance : variances) result.push_back(1 / variance);
  return result;
}

NoiseField estimate_noise_field(const FlatMesh& mesh, std::span<const float> residuals) {
  const std::size_t count = mesh.vertex_count;
  const auto inner = static_cast<std::size_t>(std::ranges::count(mesh.at_border, std::uint8_t{0}));
  const bool leave_out_border = inner > count / 2;
  std::vector<float> squares(count), counts(count);
  double mean = 0;
  for (std::size_t v = 0; v < count; ++v) {
    squares[v] = residuals[v] * residuals[v];
    counts[v] = leave_out_border && mesh.at_border[v] != 0 ? 0 : 1;
    mean += static_cast<double>(squares[v]) / static_cast<double>(count);
  }
  std::vector<float> nearby = counts;
  if (leave_out_border && inner < count) mesh.diffuse(nearby, kRounds);
  const auto averaged = [&](std::vector<float> values) {
    for (std::size_t v = 0; v < count; ++v) values[v] *= counts[v];
    mesh.diffuse(values, kRounds);
    for (std::size_t v = 0; v < count; ++v) {
      values[v] = nearby[v] > 1e-6F ? values[v] / nearby[v] : static_cast<float>(mean);
    }
    return values;
  };
  NoiseField field;
  field.variances = averaged(squares);
  for (int round = 0; round < 2; ++round) {
    std::vector<float> limited(count);
    for (std::size_t v = 0; v < count; ++v) limited[v] = std::min(squares[v], kLargestSquare * field.variances[v]);
    field.variances = averaged(std::move(limited));
  }
  double sum = 0, sum_of_squares = 0, total = 0;
  for (std::size_t v = 0; v < count; ++v) {
    field.variances[v] = std::log(field.variances[v] + static_cast<float>(1e-3 * mean + 1e-12));
    const auto weight = static_cast<double>(counts[v]), value = static_cast<double>(field.variances[v]);
    total += weight;
    sum += weight * value;
    sum_of_squares += weight * value * value;
  }
  const double center = sum / total;
  field.spread = sum_of_squares / total - center * center;
  for (float& variance : field.variances) variance = std::exp(variance - static_cast<float>(center));
  return field;
}

}  // namespace crease
