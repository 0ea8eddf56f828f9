#pragma once

#include <vector>

#include "core/io/labelled_mesh.h"

namespace crease {

/// A mesh for rendering: its vertices are split where its normals are.
struct SplitMesh {
  std::vector<Index> source;        ///< per vertex, the original vertex; starts with 0, 1, 2, …
  std::vector<Vec3> normals;        ///< per vertex, of unit length
  std::vector<Triangle> triangles;  ///< the triangles of the mesh, in order, over the split vertices
};

/// Splits vertices. Around each vertex, the corners of its faces form fans that end at ridges (label ≥
/// kRidgeThreshold), boundaries, non-manifold edges, and edges whose faces are wound differently. A fan is also split
/// between segments, and where the corners have different numbers in `looks`, unless that is empty. The first part
/// keeps the vertex; the others get copies, in the order of the vertices and their faces. Normals are those of
/// corner_normals: the parts of one fan have the same.
SplitMesh split_along_ridges(const LabelledMesh& result, const std::vector<Triangle>& looks = {});

/// A number for each corner of each face: the same for corners of the same colour and texture coordinates. Empty if
/// that is so at every vertex.
std::vector<Triangle> corner_looks(const Appearance& appearance);

}  // namespace crease
