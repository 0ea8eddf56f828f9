#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/io/labelled_mesh.h"

namespace crease {

/// A corner of a face as seen from its vertex.
struct Corner {
  std::size_t face;
  std::size_t place;  ///< 0, 1 or 2
  Index next, previous;
};

/// The corners of all faces, vertex by vertex, in the order of the faces.
class CornerRows {
 public:
  /// `mesh` must outlive this.
  explicit CornerRows(const Mesh& mesh);

  void read(std::size_t vertex, std::vector<Corner>& corners) const;

 private:
  const Mesh& mesh_;
  std::vector<std::size_t> starts_;
  std::vector<std::size_t> places_;
};

/// For each vertex, the other ends of its ridges in ascending order.
IndexRows ridge_ends(const LabelledMesh& result);

/// Joins the corners around a vertex into fans, which end at ridges, boundaries, non-manifold edges, and edges whose
/// faces are wound differently. It is a union-find over spokes, sorted by their far end: the time is nearly linear in
/// the valence of the vertex.
class FanFinder {
 public:
  /// Returns the fan of each corner, named by its first corner. `ridges` are in ascending order. With `segments` of the
  /// faces, fans end between segments too.
  const std::vector<std::size_t>& find(Index vertex, const std::vector<Corner>& corners, std::span<const Index> ridges,
                                       std::span<const Index> segments);

 private:
  /// An edge of a face, seen from the current vertex.
  struct Spoke {
    Index to;
    std::size_t corner;
    bool outgoing;
  };

  std::size_t root(std::size_t corner);

  std::vector<std::size_t> fans_;
  std::vector<Spoke> spokes_;
};

}  // namespace crease
