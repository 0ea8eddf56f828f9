#include "core/choice/uncertainty.h"

#include <algorithm>
#include <cmath>

#include "core/choice/linear_field.h"

namespace crease {
namespace {

constexpr std::uint32_t kDraws = 2;  ///< of eight each
/// Of what the risk has beyond the spread: the rest of it is the error of the risk itself.
constexpr double kBiasShare = 0.5;
constexpr int kSmoothingRounds = 1;  ///< rounds; the draws alone are right to a sixth

/// How many stages smoothed, each what the one before had made; 0 if each was about what was measured.
int steps_of_diffusion(const GraduatedOptions& options) {
  return options.family.diffuses() ? options.stages - options.family.diffuses_from + 1 : 0;
}

class Uncertainty {
 public:
  Uncertainty(const Surface& surface, const FlatMesh& mesh, const FlatVectors& positions, const EndedDescent& descent,
              const ChoiceReport& report, ThreadTeam& team, const std::function<void()>& on_step)
      : surface_(surface),
        mesh_(mesh),
        positions_(positions),
        descent_(descent),
        report_(report),
        on_step_(on_step),
        variance_(report.noise_sigma * report.noise_sigma),
        team_(team),
        diffusion_steps_(steps_of_diffusion(descent.options)),
        field_(mesh, positions, descent.options, descent.precisions, team),
        shares_(mesh.vertex_count, 0) {}

  std::vector<double> deviations() {
    if (!(variance_ > 0)) return std::vector<double>(shares_.size(), 0);
    for (std::uint32_t number = 0; number < kDraws; ++number) {
      if (descent_.spectrum) {
        add_responses_to_noise(number);
      } else if (diffusion_steps_ > 0) {
        add_squares(field_.draw_diffused(descent_.seed, number, diffusion_steps_, on_step_));
      } else {
        add_squares(field_.draw(descent_.seed, number, on_step_));
      }
    }
    if (!report_.impulsive) mesh_.diffuse(shares_, kSmoothingRounds);
    for (std::size_t v = 0; v < shares_.size(); ++v) {
      const float most = 1 / field_.precisions()[v];  // what M⁻¹ has for bounds
      const float least = diffusion_steps_ > 0 ? 0 : 1 / field_.diagonal()[v];
      shares_[v] = std::isfinite(shares_[v]) ? std::clamp(shares_[v], std::min(least, most), most) : most;
    }
    const double bias = mean_bias();
    std::vector<double> result(shares_.size());
    for (std::size_t v = 0; v < result.size(); ++v) {
      const double share = static_cast<double>(shares_[v]) + bias / static_cast<double>(field_.precisions()[v]);
      result[v] = std::sqrt(variance_ * share);
    }
    return result;
  }

 private:
  void add_squares(const std::vector<Samples>& fields, double factor = 1) {
    const auto part = static_cast<float>(factor / (kDraws * Samples::kCount));
    for (std::size_t v = 0; v < fields.size(); ++v) shares_[v] += part * sum(fields[v].lanes * fields[v].lanes);
  }

  void add_responses_to_noise(std::uint32_t number) {
    const LazyWalk walk(surface_, team_);
    std::vector<Samples> noise(mesh_.vertex_count);
    constexpr auto kCount = static_cast<std::uint32_t>(Samples::kCount);
    for (std::uint32_t k = 0; k < kCount; ++k) {
      on_step_();
      const std::uint32_t seed = descent_.seed + kFirstSeed + number * kCount + k;
      const std::vector<double> one = descent_.spectrum->sample(walk, noise.size(), seed);
      for (std::size_t v = 0; v < noise.size(); ++v) noise[v].lanes[k] = static_cast<float>(one[v]);
    }
    const std::vector<Samples> responses = field_.response(noise, on_step_);
    add_squares(responses, 1 / variance_);
    for (std::size_t v = 0; v < noise.size(); ++v) {
      divergence_ += static_cast<double>(sum(noise[v].lanes * responses[v].lanes)) / variance_ /
                     static_cast<double>(kDraws * kCount * noise.size());
    }
  }

  /// Of the squared error beyond the mean spread, in noise variances. Impulsive noise has no risk to compare with.
  double mean_bias() {
    if (report_.impulsive) return 0;
    double spread = 0;
    for (std::size_t v = 0; v < shares_.size(); ++v) spread += static_cast<double>(field_.precisions()[v] * shares_[v]);
    spread /= static_cast<double>(shares_.size());
    if (!descent_.spectrum) divergence_ = spread;
    return kBiasShare * std::clamp(risk() - spread, 0.0, 1.0);
  }

  /// Stein's unbiased estimate of the mean squared error in noise variances: from a probe of the descent, which knows
  /// how labels respond, or else from the linear response.
  double risk() const {
    if (descent_.risk) return *descent_.risk;
    const std::vector<float> residuals = products(difference(positions_, mesh_.measured), field_.normals());
    double residual = 0;
    for (std::size_t v = 0; v < residuals.size(); ++v) {
      residual += static_cast<double>(field_.precisions()[v] * residuals[v] * residuals[v]);
    }
    return residual / variance_ / static_cast<double>(residuals.size()) + 2 * divergence_ - 1;
  }

  static constexpr std::uint32_t kFirstSeed = 100;  ///< apart from the probes of the choice

  const Surface& surface_;
  const FlatMesh& mesh_;
  const FlatVectors& positions_;
  const EndedDescent& descent_;
  const ChoiceReport& report_;
  const std::function<void()>& on_step_;
  double variance_;
  ThreadTeam& team_;
  int diffusion_steps_;
  LinearField field_;
  std::vector<float> shares_;  ///< variance of each vertex, in noise variances
  double divergence_ = 0;      ///< mean response of the result to the measured positions
};

}  // namespace

std::vector<double> posterior_deviations(const Surface& surface, const FlatMesh& mesh, const FlatVectors& positions,
                                         const EndedDescent& descent, const ChoiceReport& report, ThreadTeam& team,
                                         const std::function<void()>& on_step) {
  return Uncertainty(surface, mesh, positions, descent, report, team, on_step).deviations();
}

}  // namespace crease
