#pragma once

#include <vector>

#include "core/graduated/flat_mesh.h"

namespace crease {

/// Turns risks, per candidate and vertex, into weights that sum to 1 at each vertex, the larger the smaller the risk.
/// Returns each candidate's share of the vertices.
std::vector<double> weights_of_risks(std::vector<std::vector<float>>& risks);

/// The results of the candidates, weighted vertex by vertex.
FlatVectors blended(const std::vector<FlatVectors>& results, const std::vector<std::vector<float>>& weights);

}  // namespace crease
