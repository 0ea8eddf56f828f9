#include "tests/quality/fit_direction.h"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <map>
#include <optional>
#include <random>
#include <string_view>
#include <utility>

#include "core/choice/first_sight.h"
#include "core/choice/noise_direction.h"
#include "tests/quality/error_fit.h"
#include "tests/quality/fused_scan.h"
#include "tests/quality/pairs.h"

namespace crease::quality {
namespace {

constexpr std::array<double, 6> kLevels{0.02, 0.05, 0.1, 0.2, 0.3, 0.5};
constexpr std::array<std::pair<Noise, double>, 5> kOtherNoises{{{Noise::kImpulsive, 0.2},
                                                                {Noise::kImpulsive, 0.5},
                                                                {Noise::kSparse, 0.3},
                                                                {Noise::kGrowing, 0.1},
                                                                {Noise::kGrowing, 0.2}}};

constexpr std::string_view kMoved = "-moved", kFusedModel = "-fused";

/// A mesh with noise.
struct DirectionSample {
  std::string noise, family;
  DirectionOdds::Numbers numbers{};

  /// Most meshes are neither moved nor fused.
  Verdict verdict() const {
    constexpr double kWeightOfMoved = 0.2, kWeightOfFused = 0.3;
    return {is_isotropic(), is_of(kMoved) ? kWeightOfMoved : is_of(kFusedModel) ? kWeightOfFused : 1};
  }
  bool is_of(std::string_view kind) const { return noise.find(kind) != noise.npos; }
  bool is_isotropic() const { return noise.starts_with(word_of(Noise::kIsotropic)); }
  void read(std::istream& words) {
    words >> noise >> family;
    for (double& number : numbers) words >> number;
  }
};

/// Nothing where hardly any noise is seen.
void print_measured(const std::string& noise, const std::string& family, const Mesh& noisy) {
  constexpr double kLeastNoise = 0.01;
  const Topology topology = build_topology(noisy);
  const Surface surface(noisy, topology);
  ThreadTeam team(1);
  const double sigma = look_at(surface, std::nullopt, std::nullopt, team).sigma;
  if (!(sigma > kLeastNoise)) return;
  fmt::print("{} {} {:.6g}\n", noise, family,
             fmt::join(direction_numbers(estimate_noise_level(surface, team), sigma), " "));
  std::fflush(stdout);
}

/// Noise of both directions and of each level, on a mesh of some kind.
void measure_levels(std::string_view kind, const std::string& family, const Mesh& original, std::mt19937_64& random) {
  for (const double level : kLevels) {
    for (const Noise noise : {Noise::kNormal, Noise::kIsotropic}) {
      print_measured(fmt::format("{}{}-{}", word_of(noise), kind, level), family,
                     add_noise_of_kind(original, noise, level, random()));
    }
  }
}

/// A mesh whose vertices have left their places for others within the surface, as those of an irregular sampling.
Mesh moved_within(const Mesh& mesh, std::mt19937_64& random) {
  constexpr double kLeast = 0.03, kMost = 0.25;
  const double far = std::uniform_real_distribution<double>(kLeast, kMost)(random);
  const std::vector<Vec3> normals = unit_vertex_normals(mesh, build_topology(mesh));
  Mesh moved = add_noise_of_kind(mesh, Noise::kIsotropic, far, random());
  for (std::size_t v = 0; v < normals.size(); ++v) {
    moved.positions[v] -= (moved.positions[v] - mesh.positions[v]).dot(normals[v]) * normals[v];
  }
  return moved;
}

struct DirectionFit {
  DirectionOdds model;
};

DirectionFit fitted_directions(const std::vector<const DirectionSample*>& samples) {
  DirectionFit fit;
  standardise(samples, &DirectionSample::numbers, fit.model);
  fit_odds(fit.model, samples, &DirectionSample::numbers,
           [](const DirectionSample& sample) { return sample.verdict(); });
  return fit;
}

void report_directions(const std::vector<DirectionSample>& samples) {
  std::map<std::string, std::array<double, 3>> shares;
  visit_left_out(samples, fitted_directions, [&](const DirectionSample& sample, const DirectionOdds& without) {
    ++shares[sample.noise].at(static_cast<std::size_t>(direction_of(without, sample.numbers)));
  });
  for (const auto& [noise, counts] : shares) {
    const double all = counts[0] + counts[1] + counts[2];
    fmt::print(stderr, "{}: {} meshes, along the normals {:.2f}, unsure {:.2f}, in all directions {:.2f}\n", noise, all,
               counts[0] / all, counts[1] / all, counts[2] / all);
  }
}

}  // namespace

void measure_directions(const Part& of) {
  constexpr std::size_t kFewestVertices = 100, kMostFaces = 60'000;
  const std::vector<TrainingModel> models = training_models({PairSet::kTraining}, of.models);
  for (std::size_t m = of.part; m < models.size(); m += of.parts) {
    const std::optional<Mesh> original = models[m].load();
    if (!original || original->positions.size() < kFewestVertices || original->triangles.size() > kMostFaces) continue;
    std::mt19937_64 random(m + 1);
    print_measured("none", models[m].family, *original);
    measure_levels("", models[m].family, *original, random);
    for (const auto& [noise, level] : kOtherNoises) {
      print_measured(fmt::format("{}-{}", word_of(noise), level), models[m].family,
                     add_noise_of_kind(*original, noise, level, random()));
    }
    measure_levels(kMoved, models[m].family, moved_within(*original, random), random);
    const FusedScan settings = random_fused_scan(random);
    const auto scan = take_fused_scan(*original, settings, random());
    if (scan && scan->original.triangles.size() <= kMostFaces) {
      measure_levels(kFusedModel, models[m].family, scan->original, random);
    }
  }
}

void write_direction_table(const std::vector<std::string>& files) {
  const auto samples = read_samples<DirectionSample>(files);
  report_directions(samples);
  print_table_head("core/choice/noise_direction.h");
  print_odds(fitted_directions(pointers_to(samples)).model, "DirectionOdds", "kFittedDirections");
  print_table_end();
}

}  // namespace crease::quality
