#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// How many there are of a kind, and which is the first.
struct Tally {
  std::uint32_t count = 0;
  std::size_t first = 0;

  void add(std::size_t index) {
    if (count == 0 || index < first) first = index;
    ++count;
  }
};

/// What keeps an upload from being smoothed as it is.
struct WeldFacts {
  Tally coincident_vertices;  ///< at the place of an earlier one
  Tally degenerate_faces;     ///< with a repeated corner after welding, or without area
  Tally duplicate_faces;      ///< with the three vertices of an earlier face, in any order
};

/// The mesh that is smoothed for an upload: coincident vertices are one, the first of them; degenerate and duplicate
/// faces are left out, and so are vertices in no face that stays. All orders are those of the upload.
struct WeldedMesh {
  Mesh mesh;
  Topology topology;
  std::vector<Index> vertex_of;      ///< per vertex of the upload; kNone if it was left out
  std::vector<Index> face_of;        ///< per face of the upload; of a duplicate, the face that stays; kNone for none
  std::vector<Index> upload_vertex;  ///< per vertex of `mesh`, the first one of the upload
  std::vector<Index> upload_face;    ///< per face of `mesh`
};

/// Welds the vertices of `upload` that are at most `tolerance` apart (exactly coincident for 0) to the first of them,
/// and leaves out degenerate and duplicate faces. Each vertex joins the nearest of the earlier ones that joined none. A
/// mesh with nothing but degenerate faces keeps them. Returns nothing if the upload can stay as it is. Positions must
/// be finite, indices in range.
std::optional<WeldedMesh> weld(const Mesh& upload, double tolerance, WeldFacts& facts);

/// Per edge of the upload's topology, the edge of the welded mesh's between the same vertices; kNone where no face
/// that stays has it.
std::vector<Index> welded_edges(const Mesh& upload, const Topology& topology, const WeldedMesh& welded);

}  // namespace crease
