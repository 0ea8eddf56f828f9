#pragma once

#include <cstdint>
#include <vector>

#include "core/error.h"
#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"
#include "core/mesh/welded_mesh.h"

namespace crease {

/// Counts and measures of the upload, before anything is changed.
struct InputFacts {
  std::uint32_t vertices = 0;
  std::uint32_t faces = 0;
  std::uint32_t edges = 0;  ///< after welding; so are the next two
  std::uint32_t boundary_edges = 0;
  std::uint32_t nonmanifold_edges = 0;    ///< with more than two faces
  std::uint32_t coincident_vertices = 0;  ///< exactly where an earlier one is
  std::uint32_t degenerate_faces = 0;     ///< with a repeated corner, or without area
  std::uint32_t duplicate_faces = 0;      ///< with the three vertices of an earlier face, in any order
  std::uint32_t isolated_vertices = 0;    ///< in no face
  std::uint32_t flipped_faces = 0;        ///< wound differently from the larger part of their component
  std::uint32_t components = 0;           ///< connected components, without isolated vertices
  double mean_edge_length = 0;
  double noise_sigma = 0;  ///< standard deviation of the noise along normals, by estimate_noise_sigma
};

/// \throw Error mesh_no_faces; mesh_not_finite with the first vertex that has no finite position
void require_faces_and_numbers(const Mesh& mesh);

/// Computes the facts, and appends a warning for each kind of element that gets special treatment. A warning names the
/// first such element of the upload. `welded`, null if the upload stays as it is, and `found` come from weld(). Edges,
/// components, lengths and noise are those of the mesh that is smoothed. Codes: vertices_welded, nonmanifold_edges,
/// twisted_edges (whose two faces cannot be wound consistently, as on a Möbius strip), degenerate_faces,
/// duplicate_faces, isolated_vertices, inconsistent_winding.
///
/// \throw Error mesh_not_finite if squared lengths overflow; mesh_no_extent if all edges have length zero, or squared
///        lengths underflow
InputFacts inspect(const Mesh& upload, const Topology& upload_topology, const WeldedMesh* welded,
                   const WeldFacts& found, std::vector<Warning>& warnings, ThreadTeam& team = calling_thread());

}  // namespace crease
