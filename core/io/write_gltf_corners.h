#pragma once

#include <vector>

#include "core/io/labelled_mesh.h"

namespace crease {

/// A mesh whose vertices are split where its normals are: what a renderer wants.
struct SplitMesh {
  std::vector<Index> source;        ///< per vertex, the vertex of the mesh; the first ones are 0, 1, 2, …
  std::vector<Vec3> normals;        ///< per vertex, of unit length
  std::vector<Triangle> triangles;  ///< of the mesh, in order, over the split vertices
};

/// Around each vertex, the corners of its faces form fans that end at ridges (label ≥ kRidgeThreshold), boundaries,
/// non-manifold edges, and edges across which the faces are not wound alike. Each fan has the area-weighted mean of
/// its normals. The parts of a fan in different segments are told apart too, but have the same normal. The first part
/// keeps the vertex, the others get copies, in the order of the vertices and their faces.
SplitMesh split_along_ridges(const LabelledMesh& result);

}  // namespace crease
