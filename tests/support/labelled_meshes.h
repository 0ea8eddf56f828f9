#pragma once

#include <random>
#include <vector>

#include "core/io/encode.h"

namespace crease::test {

/// The mesh with its edges, their dihedral angles, and the label 1 on interior edges of more than 25 degrees, 0.1 on
/// others: a result as a job gives it, but known beforehand.
LabelledMesh labelled(const Mesh& mesh);

/// Anywhere in [0, 1] on interior edges, 0 on others.
std::vector<double> random_labels(const Topology& topology, std::mt19937& random);

}  // namespace crease::test
