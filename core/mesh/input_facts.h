#pragma once

#include <cstdint>
#include <vector>

#include "core/error.h"
#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// What an upload is, counted before anything is changed.
struct InputFacts {
  std::uint32_t vertices = 0;
  std::uint32_t faces = 0;
  std::uint32_t edges = 0;
  std::uint32_t boundary_edges = 0;
  std::uint32_t nonmanifold_edges = 0;  ///< with more than two faces
  std::uint32_t degenerate_faces = 0;   ///< repeated corner or no area
  std::uint32_t duplicate_faces = 0;    ///< same three vertices as an earlier face, in any order
  std::uint32_t isolated_vertices = 0;  ///< in no face
  std::uint32_t flipped_faces = 0;      ///< wound against the larger part of their component
  std::uint32_t components = 0;         ///< of the vertices that have faces
  double mean_edge_length = 0;
  double noise_sigma = 0;  ///< estimated standard deviation of the noise along normals, see estimate_noise_sigma
};

/// Counts, and appends a warning for everything that is kept but not smoothed as usual. Each names the first place.
/// Codes: nonmanifold_edges, twisted_edges (two faces that cannot be wound alike, as on a Möbius strip),
/// degenerate_faces, duplicate_faces, isolated_vertices, inconsistent_winding.
///
/// \throw Error mesh_no_faces; mesh_not_finite with the first such vertex, or when squared lengths are not finite;
///        mesh_no_extent when all edges have length zero, or squared lengths vanish
InputFacts inspect(const Mesh& mesh, const Topology& topology, std::vector<Warning>& warnings);

}  // namespace crease
