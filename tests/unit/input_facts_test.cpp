#include "core/mesh/input_facts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "core/job.h"
#include "core/measure/noise.h"
#include "core/mesh/noise_estimate.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

struct Inspected {
  InputFacts facts;
  std::set<std::string> codes;
};

Inspected look(const Mesh& mesh) {
  const CheckedInput input = check_mesh(mesh);
  Inspected result{input.facts, {}};
  for (const Warning& warning : input.warnings) {
    EXPECT_TRUE(result.codes.insert(warning.code).second) << "twice: " << warning.code;
    EXPECT_THAT(warning.detail, testing::HasSubstr("the first is"));
  }
  return result;
}

Mesh member(const std::string& name) {
  for (const auto& candidate : test::mesh_family()) {
    if (candidate.name == name) return candidate.mesh;
  }
  throw std::logic_error("no mesh " + name);
}

double estimate(const Mesh& mesh) { return estimate_noise_sigma(mesh, build_topology(mesh)); }

TEST(InputFacts, ClosedSurfacesSatisfyEulersFormula) {
  for (const Mesh& mesh : {test::icosphere(3), test::cube(4), test::cylinder(20, 4, 1, 2), test::cad_part(2).mesh}) {
    const auto [facts, codes] = look(mesh);
    EXPECT_EQ(facts.vertices + facts.faces - facts.edges, 2U);
    EXPECT_EQ(2 * facts.edges, 3 * facts.faces);
    EXPECT_EQ(facts.components, 1U);
    EXPECT_EQ(facts.boundary_edges, 0U);
    EXPECT_THAT(codes, testing::IsEmpty());
  }
}

TEST(InputFacts, CountsAgreeWithTheFamily) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : test::mesh_family()) {
    SCOPED_TRACE(name);
    const auto [facts, codes] = look(mesh);
    EXPECT_EQ(facts.vertices, mesh.positions.size());
    EXPECT_EQ(facts.faces, mesh.triangles.size());
    const bool smooths_as_manifold = manifold || name == "duplicate_faces";
    EXPECT_EQ(facts.nonmanifold_edges == 0, smooths_as_manifold);
    EXPECT_EQ(facts.boundary_edges == 0, closed);
    EXPECT_EQ(facts.degenerate_faces > 0, degenerate);
    EXPECT_EQ(codes.contains("nonmanifold_edges"), !smooths_as_manifold);
    EXPECT_EQ(codes.contains("degenerate_faces"), degenerate);
    EXPECT_EQ(codes.contains("duplicate_faces"), facts.duplicate_faces > 0);
    EXPECT_EQ(codes.contains("isolated_vertices"), facts.isolated_vertices > 0);
    EXPECT_EQ(codes.contains("inconsistent_winding"), facts.flipped_faces > 0);
    EXPECT_GT(facts.mean_edge_length, 0);
    EXPECT_TRUE(std::isfinite(facts.noise_sigma) && facts.noise_sigma >= 0);
  }
}

TEST(InputFacts, EachAnomalyIsCounted) {
  EXPECT_EQ(look(member("two_components")).facts.components, 2U);
  EXPECT_EQ(look(member("touching_tetrahedra")).facts.components, 1U);
  EXPECT_EQ(look(member("finned_grid")).facts.nonmanifold_edges, 2U);
  EXPECT_EQ(look(member("duplicate_faces")).facts.duplicate_faces, 2U);
  EXPECT_EQ(look(member("collinear_face")).facts.degenerate_faces, 1U);
  EXPECT_EQ(look(member("zero_length_edge")).facts.degenerate_faces, 2U);
  EXPECT_EQ(look(member("repeated_corners")).facts.degenerate_faces, 2U);
  EXPECT_EQ(look(member("isolated_vertices")).facts.isolated_vertices, 3U);
  const Mesh wound = member("inconsistently_wound");
  EXPECT_EQ(look(wound).facts.flipped_faces, (wound.triangles.size() + 4) / 5);
  EXPECT_THAT(look(member("mobius")).codes, testing::Contains("twisted_edges"));
  EXPECT_EQ(look(test::grid(3, 2)).facts.boundary_edges, 10U);
}

TEST(InputFacts, BoundariesCauseNoWarning) { EXPECT_THAT(look(test::grid(5, 5)).codes, testing::IsEmpty()); }

TEST(InputFacts, WarningsAreAddedAfterExistingOnes) {
  const Mesh mesh = member("isolated_vertices");
  std::vector<Warning> warnings = {{"polygons_triangulated", "12 faces"}};
  inspect(mesh, build_topology(mesh), nullptr, {}, warnings);
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_EQ(warnings[0].code, "polygons_triangulated");
  EXPECT_EQ(warnings[1].detail, "3 vertices are in no face: returned as given; the first is vertex 0");
}

TEST(InputFacts, RefusesMeshesThatCannotBeSmoothed) {
  const auto refusal = [](const Mesh& mesh) -> std::pair<std::optional<ErrorCode>, std::string> {
    try {
      look(mesh);
    } catch (const Error& error) {
      return {error.code(), error.place()};
    }
    return {};
  };
  using testing::Pair;
  Mesh mesh = test::cube(2);
  EXPECT_THAT(refusal({mesh.positions, {}}), Pair(code::kMeshNoFaces, ""));
  EXPECT_THAT(refusal({{}, {}}), Pair(code::kMeshNoFaces, ""));
  for (const double odd : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    Mesh broken = mesh;
    broken.positions[5].y() = odd;
    EXPECT_THAT(refusal(broken), Pair(code::kMeshNotFinite, "vertex 5"));
  }
  EXPECT_THAT(refusal({std::vector<Vec3>(3, Vec3(1, 2, 3)), {{0, 1, 2}}}), Pair(code::kMeshNoExtent, ""));
  EXPECT_THAT(refusal({mesh.positions, {{1, 1, 1}}}), Pair(code::kMeshNoExtent, ""));
  Mesh huge = mesh, minute = mesh;
  for (Vec3& position : huge.positions) position *= 1e300;
  for (Vec3& position : minute.positions) position *= 1e-300;
  EXPECT_THAT(refusal(huge), Pair(code::kMeshNotFinite, ""));
  EXPECT_THAT(refusal(minute), Pair(code::kMeshNoExtent, ""));
}

TEST(NoiseEstimate, IsNearZeroWithoutNoise) {
  for (const Mesh& mesh :
       {test::grid(30, 30), test::icosphere(4), test::cube(12), test::cad_part(4).mesh, test::cylinder(40, 20, 1, 2)}) {
    EXPECT_LT(estimate(mesh), 0.01);
  }
}

TEST(NoiseEstimate, MeasuresTheAddedNoise) {
  for (const Mesh& mesh : {test::grid(60, 60), test::icosphere(4), test::cad_part(6).mesh}) {
    SCOPED_TRACE(mesh.triangles.size());
    for (const double sigma : {0.05, 0.1, 0.2, 0.3, 0.5, 0.7}) {
      EXPECT_NEAR(estimate(add_noise(mesh, sigma, 1, NoiseKind::kNormal)), sigma, 0.15 * sigma);
    }
  }
}

TEST(NoiseEstimate, ImpulsiveNoiseCountsOverAllVertices) {
  for (const Mesh& mesh : {test::grid(60, 60), test::icosphere(4), test::cad_part(6).mesh}) {
    SCOPED_TRACE(mesh.triangles.size());
    for (const double sigma : {0.1, 0.3, 0.5, 0.7}) {
      const double over_all = sigma * std::sqrt(0.5);
      EXPECT_NEAR(estimate(add_noise(mesh, sigma, 2, NoiseKind::kImpulsive)), over_all, 0.15 * over_all);
    }
  }
}

TEST(NoiseEstimate, MeasuresIsotropicNoise) {
  for (const Mesh& mesh : {test::grid(60, 60), test::icosphere(4), test::cad_part(6).mesh}) {
    SCOPED_TRACE(mesh.triangles.size());
    for (const double sigma : {0.05, 0.1, 0.2, 0.3}) {
      EXPECT_NEAR(estimate(add_noise(mesh, sigma, 3, NoiseKind::kGaussian)), sigma, 0.15 * sigma);
    }
  }
}

TEST(NoiseEstimate, DoesNotDependOnPositionScaleOrRotation) {
  const Mesh mesh = add_noise(test::cad_part(3).mesh, 0.2, 1, NoiseKind::kNormal);
  Mesh moved = mesh;
  for (Vec3& p : moved.positions) p = 1e-4 * Vec3(p.y(), p.z(), p.x()) + Vec3(3, 2, 1);
  EXPECT_NEAR(estimate(moved), estimate(mesh), 1e-6);
}

TEST(NoiseEstimate, IsZeroForMeshesThatAreTooSmall) {
  EXPECT_EQ(estimate(member("triangle")), 0);
  EXPECT_EQ(estimate(member("tetrahedron")), 0);
}

}  // namespace
}  // namespace crease
