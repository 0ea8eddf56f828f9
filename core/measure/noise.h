#pragma once

#include <cstdint>
#include <string_view>

#include "core/mesh/mesh.h"

namespace crease {

enum class NoiseKind {
  kGaussian,   ///< isotropic: each coordinate gets N(0, σ²)
  kNormal,     ///< along the vertex normal, N(0, σ²)
  kImpulsive,  ///< along the vertex normal, N(0, σ²), on a random half of the vertices
};

/// "gaussian", "normal", "impulsive". \throw Error parameter_invalid for any other name
NoiseKind noise_kind_from_name(std::string_view name);

/// Moves the vertices by noise of standard deviation `sigma` mean edge lengths (0 or more). Normals are area-weighted;
/// a vertex without one stays where noise is along normals. The same seed gives the same bytes; a vertex's random
/// numbers depend on seed and index only, so that two kinds or two sigmas with one seed are comparable.
/// \throw Error parameter_out_of_range for a negative or infinite sigma
Mesh add_noise(const Mesh& mesh, double sigma, std::uint64_t seed, NoiseKind kind);

}  // namespace crease
