#pragma once

#include <cstdint>

#include "core/smooth/field.h"

namespace crease {

/// Moves the vertices until the faces look along the field's normals, in the least-squares sense: `steps` steps down
/// the gradient of Σ (n_f · (v_i − v_j))² over the sides of all faces [Taubin 2001; Shen & Barner 2004], each as long
/// as is safe [Sun et al. 2007]. The normals themselves stay as they are.
void fit_vertices(Field& field, std::uint32_t steps, ThreadTeam& team);

}  // namespace crease
