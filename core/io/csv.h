#pragma once

#include <string>

#include "core/io/labelled_mesh.h"

namespace crease {

/// Writes the heading "v0,v1,label,dihedral_deg" and a line for each edge with label ≥ `min_label`: the same edges and
/// numbers as write_labels_json.
std::string write_labels_csv(const LabelledMesh& result, double min_label = 0);

}  // namespace crease
