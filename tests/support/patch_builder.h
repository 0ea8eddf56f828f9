#pragma once

#include <array>
#include <functional>
#include <map>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease::test {

/// Builds a mesh from parametrised patches. Points closer than 1e-7 become one vertex.
class PatchBuilder {
 public:
  Index vertex(const Vec3& point);
  void triangle(Index a, Index b, Index c);

  /// Starts another smooth surface for the following faces.
  void next_surface() { ++surface_; }

  /// Adds a lattice of columns × rows cells. Seen from outside, u runs right and v runs up.
  void patch(int columns, int rows, const std::function<Vec3(int, int)>& point);

  /// Adds a flat disc facing +z or −z, made of concentric rings whose numbers of points grow with the radius.
  void disc(const Vec3& centre, double radius, int around, bool up);

  /// The same with `place` for each point of the unit disc in the plane z = 0.
  void disc(int around, bool up, const std::function<Vec3(const Vec3&)>& place);

  static Vec3 on_circle(const Vec3& centre, double radius, int i, int count);

  const Mesh& mesh() const { return mesh_; }

  /// Edges between faces of different surfaces, in the order of their vertices.
  std::vector<Edge> surface_borders() const;

 private:
  /// Adds triangles between two rings that start at the same angle, always stepping to the smaller angle.
  void stitch(const std::vector<Index>& inner, const std::vector<Index>& outer, bool up);

  Mesh mesh_;
  std::vector<int> surfaces_;
  int surface_ = 0;
  std::map<std::array<long long, 3>, Index> vertices_;
};

}  // namespace crease::test
