#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// Edges of the reference with a larger dihedral angle count as ridges.
inline constexpr double kReferenceRidgeDeg = 25.0;

/// How well labels of at least kRidgeThreshold (core/mesh/topology.h) match the ridges of the reference, over its
/// interior edges. All three scores are 1 if neither side has a ridge, and 0 if only one side has any.
struct LabelScore {
  double precision = 0, recall = 0, f1 = 0;
  std::uint32_t reference_ridges = 0, labelled_ridges = 0;
};

struct Measurement {
  double mean_normal_error_deg = 0;  ///< unweighted, over the faces that have a normal in both meshes
  double max_normal_error_deg = 0;
  double mean_vertex_error = 0;  ///< distance of corresponding vertices in mean edge lengths of the reference
  double max_vertex_error = 0;
  double volume_change = 0;  ///< (V − V_ref) / |V_ref|; 0 for a reference that encloses no volume
  std::optional<LabelScore> labels;
};

/// Labels from a labels file. Each edge is given by its vertices in either order. Missing edges have label 0.
struct EdgeLabels {
  std::vector<Edge> edges;
  std::vector<double> labels;
};

/// Compares `mesh` with `reference`, vertex by vertex and face by face.
/// \throw Error mesh_mismatch if the meshes differ in their faces or number of vertices, or if a label is not of an
///        edge; mesh_no_extent if all edges of the reference have length zero
Measurement measure(const Mesh& reference, const Mesh& mesh, const EdgeLabels* labels = nullptr);

/// The change of the signed volume when the vertices of `reference` move to `positions`, relative to the magnitude of
/// the volume before. 0 if an edge is not interior or the volume before is zero.
double relative_volume_change(const Mesh& reference, const Topology& topology, const std::vector<Vec3>& positions);

}  // namespace crease
