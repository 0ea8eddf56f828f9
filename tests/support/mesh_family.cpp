#include <utility>

#include "tests/support/meshes.h"

namespace crease::test {
namespace {

Mesh tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

Mesh two_components() { return joined({icosphere(2), moved(grid(5, 4, 0.3), 1, {3, 0, 0})}); }

/// Two tetrahedra that share one vertex and no edge.
Mesh touching_tetrahedra() {
  Mesh mesh = tetrahedron();
  mesh.positions.insert(mesh.positions.end(), {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}});
  mesh.triangles.insert(mesh.triangles.end(), {{0, 4, 5}, {0, 6, 4}, {0, 5, 6}, {4, 6, 5}});
  return mesh;
}

/// A grid with faces standing on the edges of its first face, so that these edges have three faces.
Mesh finned_grid() {
  Mesh mesh = grid(6, 6);
  const auto top = static_cast<Index>(mesh.positions.size());
  const Triangle base = mesh.triangles[mesh.triangles.size() / 2];
  mesh.positions.emplace_back(mesh.positions[base[0]] + Vec3(0, 0, 1));
  mesh.triangles.push_back({base[0], base[1], top});
  mesh.triangles.push_back({base[1], base[2], top});
  return mesh;
}

/// A grid with a face over three collinear vertices of its boundary.
Mesh collinear_face() {
  Mesh mesh = grid(4, 4);
  const auto at = [&](double x) {
    Index vertex = 0;
    while (mesh.positions[vertex] != Vec3(x, 0, 0)) ++vertex;
    return vertex;
  };
  mesh.triangles.push_back({at(2), at(1), at(0)});
  return mesh;
}

/// A closed mesh with two vertices at one position, so that an edge has no length and two faces have no area.
Mesh zero_length_edge() {
  Mesh mesh = icosphere(2);
  mesh.positions[mesh.triangles[7][1]] = mesh.positions[mesh.triangles[7][0]];
  return mesh;
}

Mesh repeated_corners() {
  Mesh mesh = grid(4, 4);
  const auto base = static_cast<Index>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {{9, 0, 0}, {9, 1, 0}});
  mesh.triangles.insert(mesh.triangles.begin() + 3, {base, base, base + 1});
  mesh.triangles.push_back({base, base, base});
  return mesh;
}

Mesh duplicate_faces() {
  Mesh mesh = icosphere(2);
  const Triangle first = mesh.triangles[3], second = mesh.triangles[40];
  mesh.triangles.push_back({first[1], first[2], first[0]});
  mesh.triangles.push_back({second[1], second[0], second[2]});
  return mesh;
}

Mesh isolated_vertices() {
  Mesh mesh = joined({{{{5, 5, 5}}, {}}, grid(3, 3)});
  mesh.positions.insert(mesh.positions.end(), {{-5, 0, 0}, {-5, 0, 0}});
  return mesh;
}

Mesh inconsistently_wound() {
  Mesh mesh = cube(4);
  for (std::size_t face = 0; face < mesh.triangles.size(); face += 5) {
    std::swap(mesh.triangles[face][1], mesh.triangles[face][2]);
  }
  return mesh;
}

}  // namespace

std::vector<NamedMesh> mesh_family() {
  using M = NamedMesh;
  std::vector<NamedMesh> family;
  family.push_back(M{.name = "triangle", .mesh = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}});
  family.push_back(M{.name = "tetrahedron", .mesh = tetrahedron(), .closed = true});
  family.push_back(M{.name = "grid", .mesh = grid(8, 6, 0.5)});
  family.push_back(M{.name = "icosphere", .mesh = icosphere(3), .closed = true});
  family.push_back(M{.name = "cube", .mesh = cube(5), .closed = true});
  family.push_back(M{.name = "cylinder", .mesh = cylinder(24, 8, 1, 2), .closed = true});
  family.push_back(M{.name = "cad_part", .mesh = cad_part(2).mesh, .closed = true});
  family.push_back(M{.name = "mobius", .mesh = mobius(30)});
  family.push_back(M{.name = "two_components", .mesh = two_components()});
  family.push_back(M{.name = "touching_tetrahedra", .mesh = touching_tetrahedra(), .closed = true});
  family.push_back(M{.name = "finned_grid", .mesh = finned_grid(), .manifold = false});
  family.push_back(M{.name = "duplicate_faces", .mesh = duplicate_faces(), .manifold = false, .closed = true});
  family.push_back(M{.name = "collinear_face", .mesh = collinear_face(), .degenerate = true});
  family.push_back(M{.name = "zero_length_edge", .mesh = zero_length_edge(), .closed = true, .degenerate = true});
  family.push_back(M{.name = "repeated_corners", .mesh = repeated_corners(), .degenerate = true});
  family.push_back(M{.name = "isolated_vertices", .mesh = isolated_vertices()});
  family.push_back(M{.name = "inconsistently_wound", .mesh = inconsistently_wound(), .closed = true});
  family.push_back(M{.name = "microscopic", .mesh = moved(icosphere(2), 1e-9, {0, 0, 0}), .closed = true});
  family.push_back(M{.name = "far_away", .mesh = moved(cube(3), 1, {1e6, -2e6, 3e6}), .closed = true});
  return family;
}

}  // namespace crease::test
