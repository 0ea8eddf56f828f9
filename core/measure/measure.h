#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// Reference edges with a larger dihedral angle count as ridges.
inline constexpr double kReferenceRidgeDeg = 25.0;

/// Labels of at least kRidgeThreshold (core/mesh/topology.h) against the reference's ridges, over its interior edges.
/// Where neither side has a ridge all three are 1; where only one side has, they are 0.
struct LabelScore {
  double precision = 0, recall = 0, f1 = 0;
  std::uint32_t reference_ridges = 0, labelled_ridges = 0;
};

struct Measurement {
  double mean_normal_error_deg = 0;  ///< unweighted over faces that have a normal in both meshes
  double max_normal_error_deg = 0;
  double mean_vertex_error = 0;  ///< distance of corresponding vertices in mean edge lengths of the reference
  double max_vertex_error = 0;
  double volume_change = 0;  ///< (V − V_ref) / |V_ref|; 0 for a reference that encloses none
  std::optional<LabelScore> labels;
};

/// Labels for edges given by their vertices in either order, as they come from a labels file. An edge that is not
/// among them has label 0.
struct EdgeLabels {
  std::vector<Edge> edges;
  std::vector<double> labels;
};

/// How far `mesh` is from `reference`, vertex by vertex and face by face.
/// \throw Error mesh_mismatch unless both meshes have the same faces over as many vertices, or a label names no edge;
///        mesh_no_extent when all edges of the reference have length zero
Measurement measure(const Mesh& reference, const Mesh& mesh, const EdgeLabels* labels = nullptr);

/// Change of the signed volume when the vertices of `reference` move to `positions`, relative to its magnitude before.
/// 0 unless every edge is interior and the volume is not zero.
double relative_volume_change(const Mesh& reference, const Topology& topology, const std::vector<Vec3>& positions);

}  // namespace crease
