#pragma once

#include <optional>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// Reference edges with a larger dihedral angle count as ridges.
inline constexpr double kReferenceRidgeDeg = 25.0;

struct LabelScore {
  double precision = 0, recall = 0, f1 = 0;
  std::uint32_t reference_ridges = 0, labelled_ridges = 0;
};

struct Measurement {
  double mean_normal_error_deg = 0;  ///< unweighted over faces that have a normal in both meshes
  double max_normal_error_deg = 0;
  double mean_vertex_error = 0;      ///< distance of corresponding vertices in mean edge lengths of the reference
  double max_vertex_error = 0;
  double volume_change = 0;          ///< (V − V_ref) / |V_ref|
  std::optional<LabelScore> labels;
};

/// Labels for edges given by their vertices, as they come from a labels file.
struct EdgeLabels {
  std::vector<Edge> edges;
  std::vector<double> labels;
};

/// \throw Error mesh_mismatch unless both meshes have the same faces over as many vertices, or a label names no edge
Measurement measure(const Mesh& reference, const Mesh& mesh, const EdgeLabels* labels = nullptr);

}  // namespace crease
