#pragma once

#include <random>
#include <vector>

#include "core/io/encode.h"

namespace crease::test {

/// The mesh as a job's result with known labels: 1 on interior edges of more than 25 degrees, 0.1 on others.
LabelledMesh labelled(const Mesh& mesh);

/// Random labels in [0, 1] on interior edges, 0 on others.
std::vector<double> random_labels(const Topology& topology, std::mt19937& random);

}  // namespace crease::test
