#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/choice/evidence.h"
#include "core/choice/expected_error.h"
#include "core/choice/features.h"
#include "core/smooth/smooth.h"
#include "tests/quality/pairs.h"

namespace crease::quality {
namespace {

GraduatedResult solved(const SolveRequest& request) {
  ThreadTeam team(1);
  return GraduatedDescent(request.mesh, request.measured, request.options, request.precisions, request.latent, team)
      .run();
}

/// A pair that is made here, with what the automatic setting works on.
struct Work {
  Pair pair;
  Topology topology;
  Surface surface;
  FlatMesh mesh;

  explicit Work(const PairRecipe& recipe)
      : pair(*build_pair(recipe, {})),
        topology(build_topology(pair.noisy)),
        surface(pair.noisy, topology),
        mesh(surface) {}

  Evidence evidence() const {
    return gather_evidence(mesh, look_at(surface, std::nullopt, std::nullopt), {}, {}, solved, false);
  }
};

PairRecipe recipe(const std::string& model, Noise noise, double level) { return {model, model, noise, level, 5}; }

TEST(ExpectedError, IsFiniteForWhateverFeatures) {
  for (const double feature : {-1e9, 0.0, 1e9}) {
    Features features{};
    features.fill(feature);
    for (const double error : kFittedModel.expected(features)) EXPECT_TRUE(std::isfinite(error));
  }
}

/// A fit to features or settings of another number or order would pick at random.
TEST(ExpectedError, TellsFlatPartsFromRoundOnes) {
  const auto best_for = [](const PairRecipe& of) {
    const Work work(of);
    const auto errors = kFittedModel.expected(features_of(work.mesh, work.evidence()));
    return kSettings.at(static_cast<std::size_t>(std::ranges::min_element(errors) - errors.begin())).family.name;
  };
  EXPECT_EQ(best_for(recipe("stepped_block", Noise::kNormal, 0.2)), "creases");
  EXPECT_EQ(best_for(recipe("bullet", Noise::kNormal, 0.2)), "curved_creases");
}

TEST(Evidence, KnowsTheLevelOfTheNoise) {
  for (const double level : {0.02, 0.05, 0.1, 0.2, 0.3}) {
    for (const std::string model : {"channel", "stepped_block", "spindle"}) {
      const Evidence evidence = Work(recipe(model, Noise::kNormal, level)).evidence();
      EXPECT_NEAR(std::sqrt(evidence.variance), level, 0.15 * level) << model;
      EXPECT_FALSE(evidence.varying) << model << " " << level;
      EXPECT_FALSE(evidence.impulsive) << model << " " << level;
    }
  }
}

TEST(Evidence, FindsThatNoiseGrows) {
  const Evidence evidence = Work(recipe("channel", Noise::kGrowing, 0.3)).evidence();
  ASSERT_TRUE(evidence.varying);
  const auto [low, high] = std::ranges::minmax(evidence.precisions);
  EXPECT_GT(high / low, 8);  // the variance grows 64-fold
}

TEST(Evidence, FindsThatNoiseIsImpulsive) {
  EXPECT_TRUE(Work(recipe("stepped_block", Noise::kImpulsive, 0.4)).evidence().impulsive);
}

bool counts_as_correlated(const Mesh& noisy) {
  RunContext context;
  return smooth(noisy, build_topology(noisy), {MrfOptions{}, 1}, context).choice.value().correlation_length > 0;
}

/// Coarse parts under strong noise of other kinds once read as scans.
TEST(Scans, IndependentNoiseIsNotTakenForCorrelated) {
  for (const std::string model : {"cut_box", "cut_box_irregular", "cut_box_graded", "shaft", "bracket_irregular"}) {
    for (const auto& [noise, level] : {std::pair(Noise::kGrowing, 0.3), std::pair(Noise::kImpulsive, 0.5),
                                       std::pair(Noise::kIsotropic, 0.5), std::pair(Noise::kNormal, 0.3)}) {
      EXPECT_FALSE(counts_as_correlated(Work(recipe(model, noise, level)).pair.noisy)) << model << word_of(noise);
    }
  }
}

/// Noise of one wavelength, which is smoother than that of scanners, once read as shape. The parts are none of those
/// that the model was fitted to.
TEST(Scans, NoiseOfOneWavelengthIsFound) {
  for (const std::string model : {"channel", "channel_irregular"}) {
    EXPECT_TRUE(counts_as_correlated(Work(recipe(model, Noise::kCorrelated, 0.3)).pair.noisy)) << model;
  }
}

TEST(Scans, PartsWithoutNoiseAreNotTakenForScans) {
  for (const std::string model : {"channel", "channel_irregular", "channel_slivers", "spindle", "spindle_graded",
                                  "bullet", "bullet_open", "stepped_block", "facets_18"}) {
    EXPECT_FALSE(counts_as_correlated(Work(recipe(model, Noise::kNormal, 0)).pair.original)) << model;
  }
}

/// Its long thin triangles once read as a scan. So did those of couplingdown.
TEST(Scans, CoarseModelsWithoutNoiseAreNotTakenForScans) {
  for (const std::string model : {"cheese", "couplingdown"}) {
    const auto pair = build_pair(recipe(model, Noise::kNormal, 0), {});
    if (!pair) GTEST_SKIP() << "no models of CGAL here";
    EXPECT_FALSE(counts_as_correlated(pair->original)) << model;
  }
}

}  // namespace
}  // namespace crease::quality
