#include "tests/support/meshes.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "tests/support/patch_builder.h"

namespace crease::test {
namespace {

/// The block of cad_part in lattice cells: an L-shaped profile in x and z, extruded along y.
struct Block {
  int unit;
  int depth = 4 * unit, step = 4 * unit, length = 8 * unit, low = 2 * unit, high = 4 * unit, chamfer = unit;

  int top(int x) const { return x < step ? high : low; }
  /// Cells of the profile that the chamfer cuts in two keep their lower left half.
  bool is_cut(int x, int z) const {
    return x >= step && (x - (length - chamfer)) + (z - (low - chamfer)) == chamfer - 1;
  }
  bool is_outside(int x, int z) const {
    return z >= top(x) || (x >= step && (x - (length - chamfer)) + (z - (low - chamfer)) >= chamfer);
  }
};

void add_profile(PatchBuilder& builder, const Block& block, bool front) {
  const double y = front ? 0 : block.depth;
  const auto triangle = [&](Index a, Index b, Index c) {
    if (front) {
      builder.triangle(a, b, c);
    } else {
      builder.triangle(b, a, c);
    }
  };
  builder.next_surface();
  for (int x = 0; x < block.length; ++x) {
    for (int z = 0; z < block.top(x); ++z) {
      if (block.is_outside(x, z)) continue;
      const Index a = builder.vertex({1.0 * x, y, 1.0 * z}), b = builder.vertex({x + 1.0, y, 1.0 * z});
      const Index d = builder.vertex({1.0 * x, y, z + 1.0});
      triangle(a, b, d);
      if (!block.is_cut(x, z)) triangle(b, builder.vertex({x + 1.0, y, z + 1.0}), d);
    }
  }
}

/// Adds the extruded walls of the block, except the top of its step, which carries the boss.
void add_walls(PatchBuilder& builder, const Block& b) {
  const auto wall = [&](int rows, const std::function<Vec3(int)>& profile) {
    builder.next_surface();
    builder.patch(b.depth, rows, [&](int u, int v) -> Vec3 { return profile(v) + Vec3(0, u, 0); });
  };
  wall(b.length, [&](int i) { return Vec3(i, 0, 0); });
  wall(b.low - b.chamfer, [&](int i) { return Vec3(b.length, 0, i); });
  wall(b.chamfer, [&](int i) { return Vec3(b.length - i, 0, b.low - b.chamfer + i); });
  wall(b.length - b.chamfer - b.step, [&](int i) { return Vec3(b.length - b.chamfer - i, 0, b.low); });
  wall(b.high - b.low, [&](int i) { return Vec3(b.step, 0, b.low + i); });
  wall(b.high, [&](int i) { return Vec3(0, 0, b.high - i); });
}

/// The i-th of 8·half points on the border of a square around the centre, counter-clockwise from angle 0.
Vec3 on_square(const Vec3& centre, int half, int i) {
  const int around = 8 * half;
  const int side = ((i + half) % around) / (2 * half), along = (i + half) % (2 * half) - half;
  const std::array<Vec3, 4> corners = {Vec3(half, along, 0), Vec3(-along, half, 0), Vec3(-half, -along, 0),
                                       Vec3(along, -half, 0)};
  return centre + corners[static_cast<std::size_t>(side)];
}

void add_boss(PatchBuilder& builder, const Block& block) {
  const int half = block.step / 2, around = 8 * half, rows = 2 * block.unit;
  const double radius = 1.25 * block.unit, height = 1.25 * block.unit;
  const Vec3 centre(half, half, block.high);
  builder.next_surface();
  builder.patch(around, block.unit, [&](int u, int v) -> Vec3 {
    const double share = static_cast<double>(v) / block.unit;
    return (1 - share) * on_square(centre, half, u) + share * PatchBuilder::on_circle(centre, radius, u, around);
  });
  builder.next_surface();
  builder.patch(around, rows, [&](int u, int v) -> Vec3 {
    return PatchBuilder::on_circle(centre, radius, u, around) + Vec3(0, 0, height * v / rows);
  });
  builder.next_surface();
  builder.disc(centre + Vec3(0, 0, height), radius, around, true);
}

}  // namespace

Mesh grid(int columns, int rows, double spacing) {
  PatchBuilder builder;
  builder.patch(columns, rows, [](int u, int v) { return Vec3(u, v, 0); });
  Mesh mesh = builder.mesh();
  for (Vec3& position : mesh.positions) position *= spacing;
  return mesh;
}

Mesh icosphere(int subdivisions, double radius) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  Mesh mesh;
  mesh.positions = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                    {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int level = 0; level < subdivisions; ++level) {
    std::map<std::pair<Index, Index>, Index> midpoints;
    const auto midpoint = [&](Index a, Index b) {
      const auto [found, added] = midpoints.try_emplace(std::minmax(a, b), static_cast<Index>(mesh.positions.size()));
      if (added) mesh.positions.push_back((mesh.positions[a] + mesh.positions[b]) / 2);
      return found->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const Index ab = midpoint(a, b), bc = midpoint(b, c), ca = midpoint(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
    for (Vec3& position : mesh.positions) position.normalize();
  }
  for (Vec3& position : mesh.positions) position *= radius / position.norm();
  return mesh;
}

Mesh cube(int per_side, double side) {
  PatchBuilder builder;
  const int n = per_side;
  const std::array<std::array<Vec3, 3>, 6> sides = {{{Vec3(0, 0, n), Vec3(1, 0, 0), Vec3(0, 1, 0)},
                                                     {Vec3(0, n, 0), Vec3(1, 0, 0), Vec3(0, -1, 0)},
                                                     {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 0, 1)},
                                                     {Vec3(n, n, 0), Vec3(-1, 0, 0), Vec3(0, 0, 1)},
                                                     {Vec3(n, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)},
                                                     {Vec3(0, n, 0), Vec3(0, -1, 0), Vec3(0, 0, 1)}}};
  for (const auto& side_axes : sides) {
    builder.patch(n, n, [&](int u, int v) -> Vec3 { return side_axes[0] + u * side_axes[1] + v * side_axes[2]; });
  }
  Mesh mesh = builder.mesh();
  for (Vec3& position : mesh.positions) position *= side / n;
  return mesh;
}

Mesh cylinder(int around, int along, double radius, double height) {
  PatchBuilder builder;
  builder.patch(around, along, [&](int u, int v) -> Vec3 {
    return PatchBuilder::on_circle({0, 0, height * v / along}, radius, u, around);
  });
  builder.disc({0, 0, height}, radius, around, true);
  builder.disc({0, 0, 0}, radius, around, false);
  return builder.mesh();
}

Mesh moved(Mesh mesh, double scale, const Vec3& way) {
  for (Vec3& position : mesh.positions) position = scale * position + way;
  return mesh;
}

Mesh joined(const std::vector<Mesh>& meshes) {
  Mesh all;
  for (const Mesh& mesh : meshes) {
    const auto first = static_cast<Index>(all.positions.size());
    all.positions.insert(all.positions.end(), mesh.positions.begin(), mesh.positions.end());
    for (const auto& [a, b, c] : mesh.triangles) all.triangles.push_back({a + first, b + first, c + first});
  }
  return all;
}

Mesh mobius(int segments) {
  PatchBuilder builder;
  builder.patch(segments, 4, [&](int u, int v) {
    const double across = (u == segments ? 2 - v : v - 2) / 4.0;
    const double angle = 2 * M_PI * (u % segments) / segments;
    const double reach = 1 + across * std::cos(angle / 2);
    return Vec3(reach * std::cos(angle), reach * std::sin(angle), across * std::sin(angle / 2));
  });
  return builder.mesh();
}

CadPart cad_part(int resolution) {
  PatchBuilder builder;
  const Block block{resolution};
  add_walls(builder, block);
  add_profile(builder, block, true);
  add_profile(builder, block, false);
  add_boss(builder, block);
  return {builder.mesh(), builder.surface_borders()};
}

}  // namespace crease::test
