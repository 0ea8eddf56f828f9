#pragma once

#include "core/mesh/mesh.h"

namespace crease {

/// A machined part: a hexagonal flange with a round boss, a chamfer and a bore. About 8,000 vertices, closed, its flat
/// faces in planes, with noise of 0.2 mean edge lengths along the vertex normals. The same at every call.
Mesh sample_part();

/// A pumpkin, as a scanner would see it: about 10,000 vertices, closed, curved all over with soft furrows, its noise
/// correlated over several edges. The same at every call.
Mesh sample_scan();

}  // namespace crease
