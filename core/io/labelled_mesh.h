#pragma once

#include <vector>

#include "core/features/ridge_lines.h"
#include "core/features/vertex_classes.h"
#include "core/io/appearance.h"
#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// A mesh with a ridge label for every edge: the result of a job.
struct LabelledMesh {
  Mesh mesh;
  std::vector<Edge> edges;
  std::vector<double> labels;          ///< in [0, 1], per edge
  std::vector<double> dihedral_rad;    ///< signed, per edge
  std::vector<VertexClass> classes{};  ///< per vertex, or empty
  std::vector<double> sigma{};         ///< per vertex, or empty: standard deviation along the normal, in file units
  std::vector<Index> segments{};       ///< per face, or empty; kNone: left out, and no neighbour stays
  std::vector<RidgeLine> ridge_lines{};
  std::vector<Index> corners{};  ///< the vertices of class corner, ascending
  Appearance appearance{};       ///< of the upload, for formats that can keep some of it
};

}  // namespace crease
