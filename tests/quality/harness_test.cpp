#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <set>

#include "core/options/options.h"
#include "tests/quality/contenders.h"
#include "tests/quality/noise_models.h"
#include "tests/quality/pairs.h"
#include "tests/quality/parts.h"
#include "tests/quality/scores.h"

namespace crease::quality {
namespace {

TEST(Reliability, LabelsThatAreSharesOfRidgesHaveNoError) {
  Reliability reliability;
  for (int k = 0; k < 100; ++k) reliability.add(0.25, k < 25);
  for (int k = 0; k < 10; ++k) reliability.add(1, true);
  EXPECT_NEAR(reliability.calibration_error(), 0, 1e-12);
  EXPECT_EQ(reliability.bins[9].count, 10U);
  EXPECT_DOUBLE_EQ(reliability.bins[2].ridge_share(), 0.25);
}

TEST(Reliability, TheErrorIsTheGapWeightedByEdges) {
  Reliability reliability;
  for (int k = 0; k < 30; ++k) reliability.add(0.85, k < 15);  // a gap of 0.35
  for (int k = 0; k < 70; ++k) reliability.add(0.05, false);   // a gap of 0.05
  EXPECT_NEAR(reliability.calibration_error(), 0.3 * 0.35 + 0.7 * 0.05, 1e-12);
  Reliability twice = reliability;
  twice.add(reliability);
  EXPECT_NEAR(twice.calibration_error(), reliability.calibration_error(), 1e-12);
}

TEST(GeometricMean, OfKnownValues) {
  EXPECT_NEAR(geometric_mean(std::vector<double>{1, 4, 16}, 0.01), 4, 1e-12);
  EXPECT_NEAR(geometric_mean(std::vector<double>{0, 1}, 0.01), 0.1, 1e-12);
}

TEST(Scores, ATurnedFaceIsCounted) {
  const Mesh grid = test::grid(4, 4);
  const Pair pair{"grid", Noise::kNormal, 0, grid, grid};
  const Topology topology = build_topology(grid);
  Denoised same{grid.positions, {}, 0};
  EXPECT_EQ(score(pair, topology, same).flipped_faces, 0U);
  for (Vec3& position : same.positions) position.x() = -position.x();
  EXPECT_EQ(score(pair, topology, same).flipped_faces, grid.triangles.size());
}

TEST(PairSets, HeldOutPairsShareNothingWithOthers) {
  std::set<std::string> families;
  std::set<std::uint64_t> seeds;
  for (const PairSet set : {PairSet::kDevelopment, PairSet::kTraining}) {
    for (const PairRecipe& recipe : recipes_of(set)) {
      families.insert(recipe.family);
      seeds.insert(recipe.seed);
    }
  }
  for (const PairRecipe& recipe : recipes_of(PairSet::kHeldOut)) {
    EXPECT_FALSE(families.contains(recipe.family)) << recipe.name();
    EXPECT_FALSE(seeds.contains(recipe.seed)) << recipe.name();
  }
}

TEST(PairSets, EveryNameIsOfOnePair) {
  for (const PairSet set : {PairSet::kDevelopment, PairSet::kHeldOut, PairSet::kShort, PairSet::kTraining}) {
    std::set<std::string> names;
    for (const PairRecipe& recipe : recipes_of(set)) EXPECT_TRUE(names.insert(recipe.name()).second) << recipe.name();
  }
}

struct NamedPart {
  std::string name;
  CadPart part;
  bool closed = true;
};

std::vector<NamedPart> parts() {
  std::vector<NamedPart> result;
  const std::vector<std::pair<std::string, CadPart (*)(const Sampling&)>> makers{
      {"cut_box", cut_box}, {"bracket", bracket}, {"channel", channel}, {"shaft", shaft},
      {"spindle", spindle}, {"cone", cone},       {"bullet", bullet},   {"elbow", elbow}};
  for (const auto& [name, make] : makers) {
    for (const Sampling& sampling : {kRegular, kIrregular, kGraded, kSlivers, kOpen}) {
      result.push_back({name, make(sampling), sampling.closed});
    }
  }
  result.push_back({"prism", prism(16, 4, 20)});
  return result;
}

double volume_of(const Mesh& mesh) {
  double volume = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    volume += mesh.positions[a].dot(mesh.positions[b].cross(mesh.positions[c])) / 6;
  }
  return volume;
}

TEST(Parts, AreManifoldAndWoundOutwards) {
  for (const auto& [name, part, closed] : parts()) {
    const Topology topology = build_topology(part.mesh);
    std::size_t border = 0, beyond = 0;
    for (const auto count : topology.edge_face_count) {
      border += count == 1 ? 1 : 0;
      beyond += count > 2 ? 1 : 0;
    }
    EXPECT_EQ(beyond, 0U) << name;
    EXPECT_EQ(border == 0, closed) << name << ": " << border;
    EXPECT_THAT(topology.flipped, testing::Each(0)) << name;
    if (closed) {
      EXPECT_GT(volume_of(part.mesh), 0) << name;
    }
  }
}

TEST(Parts, RidgesAreWhereTheDihedralAngleIsLarge) {
  for (const auto& [name, part, closed] : parts()) {
    const Topology topology = build_topology(part.mesh);
    const std::vector<double> angles = signed_dihedral_angles(part.mesh, topology, part.mesh.positions);
    std::set<std::pair<Index, Index>> ridges;
    for (const Edge& edge : part.ridges) ridges.emplace(edge.v0, edge.v1);
    std::size_t sharp = 0, agreed = 0;
    for (std::size_t e = 0; e < topology.edges.size(); ++e) {
      if (!topology.is_interior(e) || std::abs(angles[e]) <= 25 * kDegree) continue;
      ++sharp;
      agreed += ridges.contains({topology.edges[e].v0, topology.edges[e].v1}) ? 1 : 0;
    }
    // Up to 18 edges round the apex of a cone are sharp and no ridges.
    EXPECT_GE(agreed + 18, sharp) << name;
    EXPECT_EQ(agreed, ridges.size()) << name;
  }
}

/// Mean over edges of the product of both ends' displacements, relative to their mean square.
double correlation_along_edges(const Mesh& clean, const Mesh& noisy) {
  const Topology topology = build_topology(clean);
  double products = 0, squares = 0;
  for (const auto& [v0, v1] : topology.edges) {
    const Vec3 first = noisy.positions[v0] - clean.positions[v0], second = noisy.positions[v1] - clean.positions[v1];
    products += first.dot(second);
    squares += (first.squaredNorm() + second.squaredNorm()) / 2;
  }
  return products / squares;
}

double deviation(const Mesh& clean, const Mesh& noisy) {
  double squares = 0;
  for (std::size_t v = 0; v < clean.positions.size(); ++v) {
    squares += (noisy.positions[v] - clean.positions[v]).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(clean.positions.size())) /
         mean_edge_length(clean.positions, build_topology(clean).edges);
}

TEST(NoiseModels, CorrelatedNoiseIsCorrelatedAndOfItsLevel) {
  const Mesh sphere = test::icosphere(4);
  const Mesh white = add_noise_of_kind(sphere, Noise::kNormal, 0.2, 1);
  const Mesh correlated = add_noise_of_kind(sphere, Noise::kCorrelated, 0.2, 1);
  EXPECT_LT(std::abs(correlation_along_edges(sphere, white)), 0.1);
  EXPECT_GT(correlation_along_edges(sphere, correlated), 0.8);
  EXPECT_NEAR(deviation(sphere, correlated), 0.2, 1e-3);
}

TEST(NoiseModels, GrowingNoiseGrowsEightfold) {
  const Mesh strip = test::grid(400, 20);
  const Mesh noisy = add_noise_of_kind(strip, Noise::kGrowing, 0.2, 1);
  double quiet = 0, loud = 0;
  for (std::size_t v = 0; v < strip.positions.size(); ++v) {
    const double square = (noisy.positions[v] - strip.positions[v]).squaredNorm();
    if (strip.positions[v].x() < 20) quiet += square;
    if (strip.positions[v].x() > 380) loud += square;
  }
  const double ratio = std::sqrt(loud / quiet);
  EXPECT_GT(ratio, 5);
  EXPECT_LT(ratio, 8);
}

TEST(Yardsticks, HalveTheErrorOfTheShortSet) {
  for (const PairRecipe& recipe : recipes_of(PairSet::kShort)) {
    if (recipe.level < 0.3) continue;
    const auto pair = build_pair(recipe, {});
    ASSERT_TRUE(pair);
    const Topology topology = build_topology(pair->noisy);
    const auto error = [&](const std::string& name) {
      return score(*pair, topology, find_contender(name, 1).denoise(*pair, topology)).measured.mean_normal_error_deg;
    };
    const double noisy = error("noisy"), bilateral = error("bilateral"), guided = error("guided");
    EXPECT_LT(bilateral, noisy / 2) << recipe.name();
    EXPECT_LT(guided, noisy / 2) << recipe.name();
    EXPECT_LE(error("guided-best"), guided) << recipe.name();
  }
}

TEST(Yardsticks, LeaveAPlaneAsItIs) {
  const Mesh grid = test::grid(8, 6, 0.5);
  const Pair pair{"grid", Noise::kNormal, 0, grid, grid};
  const Topology topology = build_topology(grid);
  for (const char* name : {"bilateral", "guided"}) {
    const Denoised result = find_contender(name, 1).denoise(pair, topology);
    for (std::size_t v = 0; v < grid.positions.size(); ++v) {
      EXPECT_NEAR((result.positions[v] - grid.positions[v]).norm(), 0, 1e-12) << name;
    }
  }
}

}  // namespace
}  // namespace crease::quality
