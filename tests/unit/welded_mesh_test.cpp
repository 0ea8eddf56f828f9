#include "core/mesh/welded_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "core/job.h"
#include "core/measure/noise.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

JobOutput smoothed(const Mesh& mesh, double weld_tolerance = 0, std::vector<double> weights = {}) {
  RunContext context;
  return run_job(check_mesh(mesh, std::move(weights)), {MrfOptions{}, 1, weld_tolerance}, context);
}

/// The noisy mesh of these tests: curved, with ridges.
Mesh noisy_part() { return add_noise(test::cad_part(2).mesh, 0.15, 1, NoiseKind::kNormal); }

/// Every face with corners of its own.
Mesh soup(const Mesh& mesh) {
  Mesh result;
  for (const Triangle& triangle : mesh.triangles) {
    const auto base = static_cast<Index>(result.positions.size());
    for (const Index corner : triangle) result.positions.push_back(mesh.positions[corner]);
    result.triangles.push_back({base, base + 1, base + 2});
  }
  return result;
}

/// The same in the order in which faces first use the vertices.
Mesh in_order_of_use(const Mesh& mesh) {
  Mesh result;
  std::vector<Index> number(mesh.positions.size(), kNone);
  for (Triangle triangle : mesh.triangles) {
    for (Index& corner : triangle) {
      if (number[corner] == kNone) {
        number[corner] = static_cast<Index>(result.positions.size());
        result.positions.push_back(mesh.positions[corner]);
      }
      corner = number[corner];
    }
    result.triangles.push_back(triangle);
  }
  return result;
}

std::map<std::pair<Index, Index>, double> labels_by_edge(const LabelledMesh& result) {
  std::map<std::pair<Index, Index>, double> labels;
  for (std::size_t e = 0; e < result.edges.size(); ++e) {
    labels[{result.edges[e].v0, result.edges[e].v1}] = result.labels[e];
  }
  return labels;
}

TEST(WeldedMesh, AMeshWithoutFaultsStaysAsItIs) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : test::mesh_family()) {
    WeldFacts facts;
    const bool is_welded = weld(mesh, 0, facts).has_value();
    EXPECT_EQ(is_welded,
              facts.coincident_vertices.count + facts.degenerate_faces.count + facts.duplicate_faces.count > 0)
        << name;
    if (name == "grid" || name == "cube" || name == "mobius" || name == "finned_grid" || name == "microscopic") {
      EXPECT_FALSE(is_welded) << name;
    }
  }
}

TEST(WeldedMesh, ATriangleSoupIsSmoothedAsTheMeshThatItCameFrom) {
  const Mesh whole = in_order_of_use(noisy_part()), split = soup(whole);
  const JobOutput expected = smoothed(whole), found = smoothed(split);
  const CheckedInput input = check_mesh(split);
  EXPECT_EQ(input.facts.coincident_vertices, split.positions.size() - whole.positions.size());
  EXPECT_EQ(input.facts.boundary_edges, 0U);
  EXPECT_EQ(input.warnings.at(0).code, "vertices_welded");
  ASSERT_EQ(found.result.mesh.triangles, split.triangles);
  for (std::size_t face = 0; face < whole.triangles.size(); ++face) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(found.result.mesh.positions[split.triangles[face][k]],
                expected.result.mesh.positions[whole.triangles[face][k]]);
    }
    EXPECT_EQ(found.result.segments[face], expected.result.segments[face]);
  }
  const auto by_edge = labels_by_edge(expected.result);
  for (std::size_t e = 0; e < found.result.edges.size(); ++e) {
    const auto corner = [&](Index vertex) { return whole.triangles[vertex / 3][vertex % 3]; };
    const auto [low, high] = std::minmax({corner(found.result.edges[e].v0), corner(found.result.edges[e].v1)});
    EXPECT_EQ(found.result.labels[e], by_edge.at({low, high}));
  }
  EXPECT_EQ(found.facts.ridge_edges, expected.facts.ridge_edges);
  EXPECT_GT(found.facts.ridge_edges, 0U);
  EXPECT_EQ(found.facts.rms_displacement, expected.facts.rms_displacement);
  EXPECT_EQ(found.facts.volume_change, expected.facts.volume_change);
}

TEST(WeldedMesh, TheFirstOfCoincidentVerticesGivesTheWeight) {
  const Mesh whole = in_order_of_use(noisy_part()), split = soup(whole);
  std::vector<double> weights(whole.positions.size()), of_split(split.positions.size(), 17);
  std::vector<bool> seen(whole.positions.size(), false);
  for (std::size_t i = 0; i < of_split.size(); ++i) {
    const Index vertex = whole.triangles[i / 3][i % 3];
    weights[vertex] = 1 + vertex % 3;
    if (!seen[vertex]) of_split[i] = weights[vertex];
    seen[vertex] = true;
  }
  const auto expected = smoothed(whole, 0, weights), found = smoothed(split, 0, of_split);
  EXPECT_EQ(found.result.mesh.positions[0], expected.result.mesh.positions[0]);
  EXPECT_EQ(found.facts.rms_displacement, expected.facts.rms_displacement);
}

TEST(WeldedMesh, FacesWithoutAreaDoNotDisturbTheRest) {
  const Mesh mesh = noisy_part();
  const JobOutput expected = smoothed(mesh);
  Mesh disturbed = mesh;
  const Triangle some = mesh.triangles[5], other = mesh.triangles[50];
  const auto first = disturbed.triangles.begin();
  disturbed.triangles.insert(first, {Triangle{some[0], some[1], some[0]}, Triangle{other[0], other[0], other[1]}});
  disturbed.triangles.push_back({some[2], some[2], some[2]});
  disturbed.triangles.push_back({other[0], other[1], other[1]});
  const CheckedInput input = check_mesh(disturbed);
  EXPECT_EQ(input.facts.degenerate_faces, 4U);
  EXPECT_EQ(input.facts.nonmanifold_edges, 0U);
  EXPECT_EQ(input.facts.noise_sigma, check_mesh(mesh).facts.noise_sigma);
  const JobOutput found = smoothed(disturbed);
  EXPECT_EQ(found.result.mesh.triangles, disturbed.triangles);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    EXPECT_EQ(found.result.mesh.positions[v], expected.result.mesh.positions[v]);
  }
  const auto labels = labels_by_edge(found.result);
  for (const auto& [edge, label] : labels_by_edge(expected.result)) EXPECT_EQ(labels.at(edge), label);
  EXPECT_EQ(found.facts.ridge_edges, expected.facts.ridge_edges);
  EXPECT_EQ(found.facts.segments, expected.facts.segments);
}

TEST(WeldedMesh, AFaceOverThePointsOfALineDoesNotDisturbTheRest) {
  const Mesh mesh = noisy_part();
  Mesh disturbed = mesh;
  const Triangle some = mesh.triangles[5];
  const auto middle = static_cast<Index>(disturbed.positions.size());
  disturbed.positions.push_back((disturbed.positions[some[0]] + disturbed.positions[some[1]]) / 2);
  disturbed.triangles.push_back({some[0], middle, some[1]});
  const CheckedInput input = check_mesh(disturbed);
  EXPECT_EQ(input.facts.degenerate_faces, 1U);
  EXPECT_EQ(input.facts.nonmanifold_edges, 0U);
  const JobOutput expected = smoothed(mesh), found = smoothed(disturbed);
  EXPECT_EQ(found.result.mesh.positions[middle], disturbed.positions[middle]);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    EXPECT_EQ(found.result.mesh.positions[v], expected.result.mesh.positions[v]);
  }
  EXPECT_EQ(found.facts.ridge_edges, expected.facts.ridge_edges);
}

TEST(WeldedMesh, ATwoSidedMeshIsSmoothedAsItsFrontSide) {
  for (const bool with_vertices_of_its_own : {false, true}) {
    const Mesh mesh = noisy_part();
    Mesh doubled = mesh;
    const auto base = static_cast<Index>(with_vertices_of_its_own ? mesh.positions.size() : 0);
    if (with_vertices_of_its_own) {
      doubled.positions.insert(doubled.positions.end(), mesh.positions.begin(), mesh.positions.end());
    }
    for (const auto& [a, b, c] : mesh.triangles) doubled.triangles.push_back({c + base, b + base, a + base});
    const CheckedInput input = check_mesh(doubled);
    EXPECT_EQ(input.facts.duplicate_faces, mesh.triangles.size());
    EXPECT_EQ(input.facts.nonmanifold_edges, 0U);
    EXPECT_EQ(input.facts.flipped_faces, 0U);
    const JobOutput expected = smoothed(mesh), found = smoothed(doubled);
    EXPECT_EQ(found.result.mesh.triangles, doubled.triangles);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      EXPECT_EQ(found.result.mesh.positions[v], expected.result.mesh.positions[v]);
      EXPECT_EQ(found.result.mesh.positions[v + base], expected.result.mesh.positions[v]);
    }
    EXPECT_EQ(found.facts.ridge_edges, expected.facts.ridge_edges);
  }
}

TEST(WeldedMesh, NearlyClosedMeshesCloseWithinTheTolerance) {
  const Mesh whole = in_order_of_use(noisy_part());
  Mesh split = soup(whole);
  const double length = check_mesh(whole).facts.mean_edge_length;
  std::vector<bool> seen(whole.positions.size(), false);
  for (std::size_t i = 0; i < split.positions.size(); ++i) {
    const Index vertex = whole.triangles[i / 3][i % 3];
    if (seen[vertex]) split.positions[i] += Vec3(0.01, -0.01, 0.005) * length * (i % 3 == 0 ? 1 : -1);
    seen[vertex] = true;
  }
  const JobOutput torn = smoothed(split), closed = smoothed(split, 0.05), expected = smoothed(whole);
  EXPECT_NE(torn.facts.ridge_edges, expected.facts.ridge_edges);
  EXPECT_EQ(closed.facts.ridge_edges, expected.facts.ridge_edges);
  ASSERT_EQ(closed.warnings.size(), 1U);
  EXPECT_EQ(closed.warnings[0].code, "vertices_welded_nearby");
  for (std::size_t i = 0; i < split.positions.size(); ++i) {
    const Vec3& expected_position = expected.result.mesh.positions[whole.triangles[i / 3][i % 3]];
    EXPECT_LT((closed.result.mesh.positions[i] - expected_position).norm(), 0.01 * length);
  }
}

TEST(WeldedMesh, SweepsAreShownAsThoseOfTheUpload) {
  const Mesh split = soup(noisy_part());
  const CheckedInput input = check_mesh(split);
  RunContext context;
  std::size_t sweeps = 0;
  context.on_sweep = [&](const SweepView& view) {
    EXPECT_EQ(view.positions().size(), split.positions.size());
    EXPECT_EQ(view.labels().size(), input.topology.edges.size());
    EXPECT_EQ(view.dihedral_rad().size(), input.topology.edges.size());
    return ++sweeps < 3;
  };
  EXPECT_TRUE(run_job(input, {MrfOptions{}, 1}, context).cancelled);
  EXPECT_EQ(sweeps, 3U);
}

TEST(WeldedMesh, CollinearPointsInAnyDirectionMakeNoArea) {
  for (int i = 0; i < 200; ++i) {
    const Vec3 a(std::sin(i), std::cos(3 * i), i * 0.37), b(std::cos(i), std::sin(2 * i), i * 0.11);
    WeldFacts facts;
    const Mesh mesh{{a, b, a + (b - a) * (i + 1) / 300.0, Vec3(9, 9, 9)}, {{0, 1, 2}, {0, 1, 3}}};
    weld(mesh, 0, facts);
    EXPECT_EQ(facts.degenerate_faces.count, 1U) << i;
    EXPECT_EQ(facts.degenerate_faces.first, 0U) << i;
  }
}

TEST(WeldedMesh, NarrowFacesHaveAnArea) {
  for (const double height : {1e-3, 1e-6, 1e-9}) {
    WeldFacts facts;
    EXPECT_FALSE(weld({{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0.5, height, 0)}, {{0, 1, 2}}}, 0, facts)) << height;
    EXPECT_EQ(facts.degenerate_faces.count, 0U) << height;
  }
}

}  // namespace
}  // namespace crease
