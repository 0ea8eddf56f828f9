#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/io/labelled_mesh.h"

namespace crease {

/// The unit normal at each corner of each face: the area-weighted mean over the faces of its fan around the vertex (see
/// FanFinder). Coincident vertices count as one, so that a seam of texture coordinates does not show. A fan without
/// area has the normal (0, 0, 1).
std::vector<std::array<Vec3, 3>> corner_normals(const LabelledMesh& result);

/// Normals of a file that each belong to some corners of faces: the means of the normals of these corners, weighted by
/// the areas of their faces.
class NormalMeans {
 public:
  /// The normals of `result` for `count` normals of a file. `result` must outlive this.
  NormalMeans(const LabelledMesh& result, std::size_t count);

  /// Gives normal `number` the corner `place` (0 to 2) of `face`.
  void add(std::size_t number, std::size_t face, std::size_t place);
  /// Gives each vertex the corners that it has.
  void add_vertices();

  /// The unit normal with this number, or nothing if no corner with an area has it.
  std::optional<Vec3> operator[](std::size_t number) const;

 private:
  const Mesh* mesh_;
  std::vector<std::array<Vec3, 3>> corners_;
  std::vector<Vec3> sums_;
};

/// The unit normal of `count` triangles from `first` on together, or nothing if they have no area.
std::optional<Vec3> face_normal(const Mesh& mesh, std::size_t first, std::size_t count);

}  // namespace crease
