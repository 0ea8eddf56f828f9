#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/io/format.h"

namespace crease {

Likeness looks_like_json(const Sample& sample);

/// Writes {"positions", "triangles", "edges", "labels", "dihedral_deg", "classes", "sigma", "segments", "extras"}.
/// Positions are the shortest decimal numbers that read back to the same doubles. "classes" (per vertex: 0 smooth, 1
/// ridge, 2 corner), "sigma" (per vertex, as exact as positions) and "segments" (per face; −1 for one that was left out
/// and touches none that stays) are left out if the result has none.
std::string write_json(const LabelledMesh& result, const nlohmann::ordered_json& extras, const MeshStyle& style);

/// Writes {"edges": [[i, j], …], "labels": […], "dihedral_deg": […], "count", "threshold"}: the `count` edges with
/// label ≥ `threshold` = min_label. Labels and degrees have up to six digits; rounding lifts no label to
/// kRidgeThreshold.
std::string write_labels_json(const LabelledMesh& result, double min_label = 0);

/// Writes {"ridges": [{"vertices", "closed", "length", "mean_label", "mean_dihedral_deg"}, …], "count", "corners"}.
/// `vertices` and `corners` are vertex indices; all other numbers have up to six digits. `extras` are not written.
std::string write_ridges_json(const LabelledMesh& result, const nlohmann::ordered_json& extras);

}  // namespace crease
