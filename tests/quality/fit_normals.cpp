#include "tests/quality/fit_normals.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <random>

#include "core/choice/choice.h"
#include "core/choice/families.h"
#include "core/choice/noise_spectrum.h"
#include "core/choice/scan.h"
#include "core/regression/normal_features.h"
#include "tests/quality/depth_camera.h"
#include "tests/quality/pairs.h"

namespace crease::quality {
namespace {

constexpr std::size_t kFewestOfSample = 100, kMostOfSample = 60'000, kFacesOfPair = 500;
constexpr std::size_t kLanes = NormalFeatures::kFaces;

/// What the descent makes of an upload, before the regression.
struct Descended {
  FlatMesh mesh;
  FlatVectors positions;
  DescentSight sight;
};

Descended descended(const Mesh& noisy, const ChoiceOptions& options) {
  const Topology topology = build_topology(noisy);
  const Surface surface(noisy, topology);
  const FlatMesh mesh(surface);
  ThreadTeam team(1);
  const Solve solve = [&](const SolveRequest& request) {
    return GraduatedDescent(request.mesh, request.measured, request.options, request.precisions, request.latent, team)
        .run();
  };
  ChoiceReport report;
  std::optional<ChoiceResult> result;
  if (!options.surface) {
    if (const auto spectrum = find_correlated_noise(surface, false, team)) {
      result = remove_correlated_noise(surface, mesh, {}, *spectrum, options, solve, report, team);
    }
  }
  if (!result) result = choose_and_solve(surface, mesh, {}, options, solve, report);
  return {mesh, std::move(result->positions), sight_of(result->setting, report)};
}

class Writer {
 public:
  explicit Writer(const std::string& file) : out_(file, std::ios::binary) {}

  /// A row per face: number of the pair, error of the pair, x, y, scalars, and the unit normal of the original in the
  /// frame of the face.
  void write(const Mesh& original, const Mesh& noisy, const ChoiceOptions& options, std::mt19937_64& random) {
    if (noisy.positions.size() < kFewestOfSample || noisy.triangles.size() > kMostOfSample) return;
    const Descended result = descended(noisy, options);
    ThreadTeam team(1);
    const auto features = normal_features(result.mesh, result.positions, result.sight, team);
    const FlatMesh truth(build_topology(noisy), original.triangles, original.positions);
    const std::size_t faces = noisy.triangles.size();
    std::vector<std::array<float, 3>> targets(faces);
    double error = 0;
    for (std::size_t f = 0; f < faces; ++f) {
      const FaceFrame frame = face_frame(result.mesh, result.positions, f),
                      right = face_frame(truth, truth.measured, f);
      const auto along = [&](const std::array<float, 3>& axis) {
        return axis[0] * right.normal[0] + axis[1] * right.normal[1] + axis[2] * right.normal[2];
      };
      targets[f] = {along(frame.first), along(frame.second), along(frame.normal)};
      error += std::acos(std::clamp(static_cast<double>(targets[f][2]), -1.0, 1.0)) / static_cast<double>(faces);
    }
    std::vector<std::size_t> chosen(faces);
    std::iota(chosen.begin(), chosen.end(), std::size_t{0});
    std::ranges::shuffle(chosen, random);
    chosen.resize(std::min(faces, kFacesOfPair));
    for (const std::size_t f : chosen) {
      put(static_cast<float>(pairs_));
      put(static_cast<float>(error));
      const NormalFeatures& block = features[f / kLanes];
      for (const auto& lanes : block.x) put(lanes.load()[f % kLanes]);
      for (const auto& lanes : block.y) put(lanes.load()[f % kLanes]);
      for (const auto& lanes : block.scalars) put(lanes.load()[f % kLanes]);
      for (const float number : targets[f]) put(number);
    }
    ++pairs_;
    out_.flush();
  }

 private:
  void put(float number) { out_.write(reinterpret_cast<const char*>(&number), sizeof number); }

  std::ofstream out_;
  std::size_t pairs_ = 0;
};

/// With noise of any kind, or hardly any. Sometimes for a surface that is named at random, or too strongly or too
/// weakly: what is learnt must help where the choice is not as good as it is for models that it knows.
void measure_model(const Mesh& original, std::mt19937_64& random, Writer& writer) {
  constexpr double kIndependent = 0.58, kHardlyAny = 0.68, kView = 0.86, kNamed = 0.2, kMostOfHardlyAny = 0.04;
  constexpr double kOtherStrength = 0.3, kMostStrength = 1.7;
  std::uniform_real_distribution<double> unit(0, 1);
  ChoiceOptions options;
  if (unit(random) < kNamed) options.surface = kSettings[random() % kSettings.size()].family.name;
  if (unit(random) < kOtherStrength) options.strength = std::pow(kMostStrength, 2 * unit(random) - 1);
  const double share = unit(random);
  const auto& [noise, level] = training_noises()[random() % training_noises().size()];
  if (share < kIndependent) {
    writer.write(original, add_noise_of_kind(original, noise, level, random()), options, random);
  } else if (share < kHardlyAny) {
    const double little = std::max(0.0, kMostOfHardlyAny * (2 * unit(random) - 1));
    writer.write(original, add_noise_of_kind(original, noise, little, random()), options, random);
  } else if (share < kView) {
    const DepthCamera camera = random_camera(random);
    DepthNoise depth_noise = random_depth_noise(random);
    const double kind = unit(random);
    if (kind < 0.1) depth_noise = {};
    if (kind < 0.25) depth_noise.fine_width = depth_noise.broad_share = depth_noise.step = 0;
    if (const auto view = take_depth_view(original, camera, depth_noise, random())) {
      writer.write(view->original, view->noisy, options, random);
    }
  } else {
    writer.write(original, with_waves(original, random), options, random);
  }
}

}  // namespace

void measure_normals(const Part& of, const std::string& file) {
  constexpr int kRounds = 6, kRoundsOfPairs = 8;
  Writer writer(file);
  const std::vector<TrainingModel> models = training_models({PairSet::kTraining}, of.models);
  for (std::size_t i = of.part; i < models.size(); i += of.parts) {
    const std::optional<Mesh> original = models[i].load();
    std::mt19937_64 random(i + 1);
    const int rounds = models[i].is_of_folder ? kRounds : kRoundsOfPairs;
    for (int round = 0; original && round < rounds; ++round) measure_model(*original, random, writer);
  }
}

}  // namespace crease::quality
