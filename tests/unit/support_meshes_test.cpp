#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "tests/support/meshes.h"

namespace crease {
namespace {

double signed_volume(const Mesh& mesh) {
  double six_volumes = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    six_volumes += mesh.positions[a].dot(mesh.positions[b].cross(mesh.positions[c]));
  }
  return six_volumes / 6;
}

/// Checks that every directed edge occurs exactly once, and so does its reverse: the mesh is closed, edge-manifold and
/// consistently wound.
void expect_closed_and_wound_alike(const Mesh& mesh) {
  std::set<std::pair<Index, Index>> directed;
  for (const Triangle& corners : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_TRUE(directed.emplace(corners[k], corners[(k + 1) % 3]).second);
    }
  }
  for (const auto& [from, to] : directed) EXPECT_TRUE(directed.contains({to, from}));
}

TEST(SupportMeshes, ClosedShapesAreClosedAndFaceOutwards) {
  for (const Mesh& mesh : {test::icosphere(2), test::cube(3), test::cylinder(20, 5, 1, 2), test::cad_part(2).mesh}) {
    SCOPED_TRACE(mesh.triangles.size());
    expect_closed_and_wound_alike(mesh);
    EXPECT_GT(signed_volume(mesh), 0);
  }
}

TEST(SupportMeshes, VolumesMatchTheSolids) {
  EXPECT_NEAR(signed_volume(test::cube(3, 2.0)), 8, 1e-12);
  EXPECT_NEAR(signed_volume(test::icosphere(5, 2.0)), 4.0 / 3 * M_PI * 8, 0.05);
  const double sides = 30;
  EXPECT_NEAR(signed_volume(test::cylinder(30, 4, 1, 2)), 2 * sides / 2 * std::sin(2 * M_PI / sides), 1e-12);
  const double around = 32, radius = 1.25 * 2, boss = radius * radius * around / 2 * std::sin(2 * M_PI / around) * 2.5;
  EXPECT_NEAR(signed_volume(test::cad_part(2).mesh), 8 * (8 * 8 + 8 * 4 - 2) + boss, 1e-9);
}

TEST(SupportMeshes, RidgesOfTheCadPartAreItsSharpEdgesAndNoOthers) {
  for (const int resolution : {1, 2, 5}) {
    const auto [mesh, ridges] = test::cad_part(resolution);
    const Topology topology = build_topology(mesh);
    const std::vector<double> angles = signed_dihedral_angles(mesh, topology, mesh.positions);
    std::vector<Edge> sharp;
    int convex = 0, concave = 0;
    for (std::size_t edge = 0; edge < topology.edges.size(); ++edge) {
      if (std::abs(angles[edge]) <= 25.0 / 180 * M_PI) continue;
      sharp.push_back(topology.edges[edge]);
      ++(angles[edge] > 0 ? convex : concave);
    }
    std::sort(sharp.begin(), sharp.end(),
              [](const Edge& a, const Edge& b) { return std::pair(a.v0, a.v1) < std::pair(b.v0, b.v1); });
    EXPECT_EQ(sharp, ridges);
    EXPECT_EQ(concave, resolution * (4 + 16));
    EXPECT_EQ(convex, resolution * (4 * 6 + 2 * (8 + 1 + 1 + 3 + 2 + 4 + 4) + 16));
  }
}

TEST(SupportMeshes, TrianglesAreWellShaped) {
  for (const Mesh& mesh : {test::cylinder(24, 8, 1, 2), test::cad_part(3).mesh, test::grid(4, 4), test::mobius(30)}) {
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::array<Vec3, 3> corner = {mesh.positions[a], mesh.positions[b], mesh.positions[c]};
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 left = corner[(k + 1) % 3] - corner[k], right = corner[(k + 2) % 3] - corner[k];
        EXPECT_GT(std::atan2(left.cross(right).norm(), left.dot(right)), 10.0 / 180 * M_PI);
      }
    }
  }
}

TEST(SupportMeshes, FamilyMembersMatchTheirDescription) {
  std::set<std::string> names;
  bool open = false, nonmanifold = false, degenerate = false, isolated = false, twisted = false, flipped = false;
  bool several = false;
  for (const auto& [name, mesh, is_manifold, is_closed, is_degenerate] : test::mesh_family()) {
    SCOPED_TRACE(name);
    EXPECT_TRUE(names.insert(name).second);
    const Topology topology = build_topology(mesh);
    const auto& counts = topology.edge_face_count;
    const bool has_boundary = std::count(counts.begin(), counts.end(), 1U) > 0;
    const bool has_crowded = std::any_of(counts.begin(), counts.end(), [](auto count) { return count > 2; });
    EXPECT_EQ(is_closed, !has_boundary);
    EXPECT_EQ(is_manifold, !has_crowded);
    const std::vector<Vec3> normals = face_normals(mesh, topology, mesh.positions);
    EXPECT_EQ(is_degenerate, std::any_of(normals.begin(), normals.end(), [](const Vec3& n) { return n.norm() == 0; }));
    open |= has_boundary;
    nonmanifold |= has_crowded;
    degenerate |= is_degenerate;
    several |= find_components(mesh).count > 1;
    twisted |= std::count(topology.edge_twisted.begin(), topology.edge_twisted.end(), 0) <
               static_cast<std::ptrdiff_t>(topology.edges.size());
    flipped |= std::count(topology.flipped.begin(), topology.flipped.end(), 0) <
               static_cast<std::ptrdiff_t>(mesh.triangles.size());
    for (std::size_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
      isolated |= topology.vertex_faces[vertex].empty();
    }
  }
  EXPECT_TRUE(open && nonmanifold && degenerate && isolated && twisted && flipped && several);
}

TEST(SupportMeshes, MissingFilesAreNullopt) {
  EXPECT_FALSE(test::development_mesh("no_such_model/noisy.obj"));
  EXPECT_FALSE(test::cgal_mesh("no_such_model.off"));
}

TEST(SupportMeshes, AModelOfTheDebianPackageCanBeRead) {
  const auto path = test::cgal_mesh("fandisk.off");
  if (!path) GTEST_SKIP() << "libcgal-demo is not installed";
  EXPECT_EQ(test::read_file(*path).substr(0, 3), "OFF");
}

}  // namespace
}  // namespace crease
