#include "tests/quality/fit_clean.h"

#include <fmt/format.h>

#include <cstdio>

#include "core/choice/clean.h"
#include "tests/quality/error_fit.h"
#include "tests/quality/known_upload.h"

namespace crease::quality {
namespace {

using CleanSample = Sample<CleanModel>;

constexpr std::array<std::pair<Noise, double>, 9> kLittleNoise{{{Noise::kNormal, 0.02},
                                                                {Noise::kNormal, 0.05},
                                                                {Noise::kNormal, 0.1},
                                                                {Noise::kNormal, 0.03},
                                                                {Noise::kIsotropic, 0.1},
                                                                {Noise::kNormal, 0.15},
                                                                {Noise::kImpulsive, 0.15},
                                                                {Noise::kIsotropic, 0.05},
                                                                {Noise::kGrowing, 0.1}}};
constexpr std::size_t kNoisyOfModel = 3;

/// Nothing where there is no doubt.
void print_measured(const Mesh& mesh, const std::string& name, const std::string& family, bool clean) {
  constexpr double kLeastDoubtful = 0.01;
  const Topology topology = build_topology(mesh);
  const Surface surface(mesh, topology);
  ThreadTeam team(1);
  const FirstSight sight = look_at(surface, std::nullopt, std::nullopt, team);
  if (!(sight.sigma > kLeastDoubtful && sight.sigma < kMostDoubtfulNoise)) return;
  const KnownUpload known(surface, sight, solve_with(team));
  fmt::print("{} {} {:.6g} {}\n", name, family, fmt::join(known.features, " "), clean ? 1 : 0);
  std::fflush(stdout);
}

Fit<CleanModel> fitted_clean(const std::vector<const CleanSample*>& samples) {
  return fitted_to<CleanModel>(samples,
                               [](const CleanSample& sample, std::size_t method) { return sample.errors.at(method); });
}

void report_mistakes(const std::vector<CleanSample>& samples) {
  constexpr std::array kThresholds{0.5, 0.6, 0.7, 0.8};
  std::array<std::array<double, 2>, kThresholds.size()> found{};
  std::array<double, 2> counts{};
  visit_left_out(samples, fitted_clean, [&](const CleanSample& sample, const CleanModel& without) {
    const std::size_t is_clean = sample.errors[0] > 0 ? 1 : 0;
    const double expected = without.expected(sample.features)[0];
    ++counts.at(is_clean);
    for (std::size_t t = 0; t < kThresholds.size(); ++t) {
      if (expected > kThresholds.at(t)) ++found.at(t).at(is_clean);
    }
  });
  fmt::print(stderr, "{} meshes with noise, {} without; taken for clean, families left out:\n", counts[0], counts[1]);
  for (std::size_t t = 0; t < kThresholds.size(); ++t) {
    fmt::print(stderr, "  above {}: {:.4f} and {:.3f}\n", kThresholds.at(t), found.at(t)[0] / counts[0],
               found.at(t)[1] / counts[1]);
  }
}

}  // namespace

void measure_clean(const Part& of) {
  constexpr std::size_t kFewestVertices = 100;
  const std::vector<TrainingModel> models = training_models({PairSet::kTraining}, of.models);
  for (std::size_t m = of.part; m < models.size(); m += of.parts) {
    const std::optional<Mesh> original = models[m].load();
    if (!original || original->positions.size() < kFewestVertices) continue;
    print_measured(*original, models[m].name, models[m].family, true);
    for (std::size_t k = 0; k < kNoisyOfModel; ++k) {
      const auto& [noise, level] = kLittleNoise.at((2 * m + 4 * k) % kLittleNoise.size());
      print_measured(add_noise_of_kind(*original, noise, level, m + k + 1),
                     fmt::format("{}-{}-{}", models[m].name, word_of(noise), level), models[m].family, false);
    }
  }
}

void write_clean_table(const std::vector<std::string>& files) {
  const auto samples = read_samples<CleanSample>(files);
  report_mistakes(samples);
  print_table_head("core/choice/clean.h");
  print_table(fitted_clean(pointers_to(samples)), "CleanModel", "Clean");
}

}  // namespace crease::quality
