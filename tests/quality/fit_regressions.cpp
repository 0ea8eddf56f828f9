#include "tests/quality/fit_regressions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <initializer_list>
#include <numeric>
#include <random>

#include "core/choice/choice.h"
#include "core/choice/families.h"
#include "core/choice/noise_spectrum.h"
#include "core/choice/scan.h"
#include "core/measure/measure.h"
#include "core/options/options.h"
#include "core/regression/label_features.h"
#include "core/regression/label_network.h"
#include "core/regression/normal_features.h"
#include "core/regression/normal_network.h"
#include "core/regression/passes.h"
#include "tests/quality/depth_camera.h"
#include "tests/quality/error_fit.h"
#include "tests/quality/fused_scan.h"
#include "tests/quality/pairs.h"

namespace crease::quality {
namespace {

constexpr std::size_t kFewestOfSample = 100, kMostOfSample = 130'000, kFacesOfPair = 500;
constexpr std::size_t kLanes = NormalFeatures::kFaces;

/// What the descent makes of an upload, before the regression.
struct Descended {
  FlatMesh mesh;
  FlatVectors positions, reference;
  DescentSight sight;
};

/// Every so manieth without a reference, as it is for large meshes.
Descended descended(const Mesh& noisy, const ChoiceOptions& options, std::mt19937_64& random) {
  constexpr int kOneWithout = 5;
  const Topology topology = build_topology(noisy);
  const Surface surface(noisy, topology);
  const FlatMesh mesh(surface);
  ThreadTeam team(1);
  const Solve solve = solve_with(team);
  ChoiceReport report;
  std::optional<ChoiceResult> result;
  if (options.correlated || !options.surface) {
    if (const auto spectrum = find_correlated_noise(surface, options.correlated, team)) {
      result = remove_correlated_noise(surface, mesh, {}, *spectrum, options, solve, report, team);
    }
  }
  if (!result) result = choose_and_solve(surface, mesh, {}, options, solve, report, team);
  if (random() % kOneWithout == 0) result->reference_positions.clear();
  return {mesh, std::move(result->positions), std::move(result->reference_positions),
          sight_of(result->setting, report)};
}

bool is_of_right_size(const Mesh& mesh) {
  return mesh.positions.size() >= kFewestOfSample && mesh.triangles.size() <= kMostOfSample;
}

/// `count` of the numbers from 0 on, or all of them, in any order.
std::vector<std::size_t> some_of(std::size_t all, std::size_t count, std::mt19937_64& random) {
  std::vector<std::size_t> numbers(all);
  std::iota(numbers.begin(), numbers.end(), std::size_t{0});
  std::ranges::shuffle(numbers, random);
  numbers.resize(std::min(all, count));
  return numbers;
}

/// A line with the sizes of a network and of a row, then numbers in single precision, one after the other: what
/// network_fit.py reads.
class NumberFile {
 public:
  NumberFile(const std::string& file, std::initializer_list<std::size_t> sizes) : out_(file, std::ios::binary) {
    out_ << fmt::format("{}\n", fmt::join(sizes, " "));
  }
  void put(float number) { out_.write(reinterpret_cast<const char*>(&number), sizeof number); }

 private:
  std::ofstream out_;
};

using Measure = std::function<void(const Descended& result, const FlatMesh& truth, std::mt19937_64&)>;

class NormalWriter {
 public:
  NormalWriter(const std::string& file, std::size_t pass)
      : pass_(pass),
        file_(file, {NormalFeatures::kVectors, NormalFeatures::kScalars, NormalNetwork::kMixtures,
                     NormalNetwork::kHidden, 2 + 2 * NormalFeatures::kVectors + NormalFeatures::kScalars + 3}) {}

  /// A row per face, as the pass finds it: number of the pair, error of the pair, x, y, scalars, and the unit normal of
  /// the original in the frame of the face.
  void operator()(const Descended& result, const FlatMesh& truth, std::mt19937_64& random) {
    ThreadTeam team(1);
    const Turned now =
        turned_in_passes(result.mesh, result.positions, result.reference, result.sight, 1, {}, pass_, team);
    const auto features = normal_features(result.mesh, now.positions, now.normals, result.sight, team);
    const std::size_t faces = truth.face_count;
    std::vector<std::array<float, 3>> targets(faces);
    double error = 0;
    for (std::size_t f = 0; f < faces; ++f) {
      const FaceFrame frame = face_frame(result.mesh, now.positions, f), right = face_frame(truth, truth.measured, f);
      const auto along = [&](const std::array<float, 3>& axis) {
        return axis[0] * right.normal[0] + axis[1] * right.normal[1] + axis[2] * right.normal[2];
      };
      targets[f] = {along(frame.first), along(frame.second), along(frame.normal)};
      error += std::acos(std::clamp(static_cast<double>(targets[f][2]), -1.0, 1.0)) / static_cast<double>(faces);
    }
    for (const std::size_t f : some_of(faces, kFacesOfPair, random)) {
      file_.put(static_cast<float>(pairs_));
      file_.put(static_cast<float>(error));
      const NormalFeatures& block = features[f / kLanes];
      for (const auto& lanes : block.x) file_.put(lanes.load()[f % kLanes]);
      for (const auto& lanes : block.y) file_.put(lanes.load()[f % kLanes]);
      for (const auto& lanes : block.scalars) file_.put(lanes.load()[f % kLanes]);
      for (const float number : targets[f]) file_.put(number);
    }
    ++pairs_;
  }

 private:
  std::size_t pass_;  ///< from 0
  NumberFile file_;
  std::size_t pairs_ = 0;
};

class LabelWriter {
 public:
  explicit LabelWriter(const std::string& file) : file_(file, {LabelNetwork::kHidden, 2 + LabelFeatures::kCount + 1}) {}

  /// A row per edge: number of the pair, how many of its edges the row stands for, features, and 1 for a ridge of the
  /// original. Half of the edges bend or should.
  void operator()(const Descended& result, const FlatMesh& truth, std::mt19937_64& random) {
    ThreadTeam team(1);
    const auto [positions, normals] =
        turned_in_passes(result.mesh, result.positions, result.reference, result.sight, 1, {}, kPasses, team);
    const LabelFeatures features(result.mesh, positions, result.reference, normals, result.sight, team);
    const std::vector<float> angles = dihedral_angles(truth, truth.measured),
                             found = dihedral_angles(result.mesh, positions);
    const auto ridge = static_cast<float>(kReferenceRidgeDeg * kDegree), bend = static_cast<float>(8 * kDegree);
    std::array<std::vector<std::size_t>, 2> edges;
    for (std::size_t e = 0; e < angles.size(); ++e) edges[angles[e] > ridge || found[e] > bend ? 1 : 0].push_back(e);
    for (const std::vector<std::size_t>& group : edges) {
      const std::vector<std::size_t> chosen = some_of(group.size(), kEdgesOfGroup, random);
      for (const std::size_t i : chosen) {
        const std::size_t e = group[i];
        file_.put(static_cast<float>(pairs_));
        file_.put(static_cast<float>(group.size()) / static_cast<float>(chosen.size()));
        const LabelFeatures::Block block = features.block(e / kLaneCount);
        for (const Lanes& lanes : block.items) file_.put(lanes[e % kLaneCount]);
        file_.put(angles[e] > ridge ? 1 : 0);
      }
    }
    ++pairs_;
  }

 private:
  static constexpr std::size_t kEdgesOfGroup = 250;
  NumberFile file_;
  std::size_t pairs_ = 0;
};

/// With noise of any kind, or hardly any. Sometimes for a surface that is named at random, or too strongly or too
/// weakly, or with growing noise that counts as correlated: what is learnt must help where the choice is not as good as
/// it is for models that it knows.
void measure_model(const Mesh& original, std::mt19937_64& random, const Measure& measure) {
  constexpr double kIndependent = 0.5, kHardlyAny = 0.57, kView = 0.76, kFused = 0.89, kNamed = 0.2;
  constexpr double kOtherStrength = 0.3, kMostStrength = 1.7, kTakenForScan = 0.4, kMostOfHardlyAny = 0.04;
  std::uniform_real_distribution<double> unit(0, 1);
  ChoiceOptions options;
  if (unit(random) < kNamed) options.surface = kSettings[random() % kSettings.size()].family.name;
  if (unit(random) < kOtherStrength) options.strength = std::pow(kMostStrength, 2 * unit(random) - 1);
  const auto write = [&](const Mesh& right, const Mesh& noisy) {
    if (!is_of_right_size(noisy)) return;
    const Descended result = descended(noisy, options, random);
    measure(result, FlatMesh(build_topology(noisy), right.triangles, right.positions), random);
  };
  const double share = unit(random);
  const auto& [noise, level] = training_noises()[random() % training_noises().size()];
  if (share < kIndependent) {
    options.correlated = noise == Noise::kGrowing && unit(random) < kTakenForScan;
    write(original, add_noise_of_kind(original, noise, level, random()));
  } else if (share < kHardlyAny) {
    const double little = std::max(0.0, kMostOfHardlyAny * (2 * unit(random) - 1));
    write(original, add_noise_of_kind(original, noise, little, random()));
  } else if (share < kView) {
    const DepthCamera camera = random_camera(random);
    DepthNoise depth_noise = random_depth_noise(random);
    const double kind = unit(random);
    if (kind < 0.1) depth_noise = {};
    if (kind < 0.25) depth_noise.fine_width = depth_noise.broad_share = depth_noise.step = 0;
    if (const auto view = take_depth_view(original, camera, depth_noise, random())) {
      write(view->original, view->noisy);
    }
  } else if (share < kFused) {
    const FusedScan settings = random_fused_scan(random);
    if (const auto scan = take_fused_scan(original, settings, random())) write(scan->original, scan->noisy);
  } else {
    write(original, with_waves(original, random));
  }
}

void measure_all(const Part& of, const Measure& measure) {
  constexpr int kRounds = 6, kRoundsOfPairs = 8;
  const std::vector<TrainingModel> models = training_models({PairSet::kTraining}, of.models);
  for (std::size_t i = of.part; i < models.size(); i += of.parts) {
    const std::optional<Mesh> original = models[i].load();
    std::mt19937_64 random(i + 1);
    const int rounds = models[i].is_of_folder ? kRounds : kRoundsOfPairs;
    for (int round = 0; original && round < rounds; ++round) measure_model(*original, random, measure);
  }
}

}  // namespace

void measure_normals(const Part& of, std::size_t pass, const std::string& file) {
  NormalWriter writer(file, pass);
  measure_all(of, std::ref(writer));
}

void measure_labels(const Part& of, const std::string& file) {
  LabelWriter writer(file);
  measure_all(of, std::ref(writer));
}

}  // namespace crease::quality
