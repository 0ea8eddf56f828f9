#pragma once

#include <cstdint>
#include <string_view>

#include "core/mesh/mesh.h"

namespace crease {

enum class NoiseKind {
  kGaussian,   ///< N(0, σ²) on each coordinate
  kNormal,     ///< along the vertex normal, N(0, σ²)
  kImpulsive,  ///< along the vertex normal, N(0, σ²), on a random half of the vertices
};

/// "gaussian", "normal", "impulsive". \throw Error parameter_invalid for any other name
NoiseKind noise_kind_from_name(std::string_view name);

/// Moves the vertices by noise with a standard deviation of `sigma` mean edge lengths (0 or more). Normals are
/// area-weighted; noise along normals does not move a vertex without one. The same seed gives the same bytes. The
/// Vertices at exactly the same position move together, as the first of them does. The
/// random numbers of a vertex depend only on the seed and its index, so that kinds and sigmas can be compared under one
/// seed. \throw Error parameter_out_of_range for a negative or infinite sigma
Mesh add_noise(const Mesh& mesh, double sigma, std::uint64_t seed, NoiseKind kind);

}  // namespace crease
