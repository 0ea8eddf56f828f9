#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/io/mesh_format.h"
#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// A mesh with a ridge label for every edge: what a job returns.
struct LabelledMesh {
  Mesh mesh;
  std::vector<Edge> edges;
  std::vector<double> labels;        ///< in [0, 1], per edge
  std::vector<double> dihedral_rad;  ///< signed, per edge
};

/// Edges with a label of at least this are drawn and counted as ridges.
inline constexpr double kRidgeThreshold = 0.5;

/// The mesh in `format`. `extras` goes into glTF/GLB asset extras and JSON, and nowhere else.
/// glTF is GLB's JSON with its buffer embedded as a data URI.
std::string encode_mesh(const LabelledMesh& result, MeshFormat format, const nlohmann::ordered_json& extras = {});

/// {"edges": [[i, j], …], "labels": […], "dihedral_deg": […], "count", "threshold"}, edges with label ≥ min.
std::string encode_labels_json(const LabelledMesh& result, double min_label = 0);
/// "v0,v1,label,dihedral_deg" with a heading line.
std::string encode_labels_csv(const LabelledMesh& result, double min_label = 0);

}  // namespace crease
