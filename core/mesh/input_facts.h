#pragma once

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
  std::uint32_t nonmanifold_edges = 0;
  std::uint32_t degenerate_faces = 0;   ///< repeated corner or no area
  std::uint32_t duplicate_faces = 0;    ///< same three vertices as an earlier face, in any order
  std::uint32_t isolated_vertices = 0;  ///< in no face
  std::uint32_t flipped_faces = 0;      ///< wound against the larger part of their component
  std::uint32_t components = 0;
  double mean_edge_length = 0;
  double noise_sigma = 0;               ///< estimated standard deviation of the noise along normals, in mean edge lengths
};

/// Counts, and warns of everything that is kept but not smoothed as usual.
/// \throw Error mesh_no_faces, mesh_not_finite, mesh_no_extent (all edges have length zero)
InputFacts inspect(const Mesh& mesh, const Topology& topology, std::vector<Warning>& warnings);

}  // namespace crease
