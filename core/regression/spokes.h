#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <vector>

#include "core/geometry/lanes.h"
#include "core/graduated/flat_mesh.h"

namespace crease {

/// Where ridges may go on at a vertex. Of a vertex with very many edges, as at the tip of a fan, these are only the
/// ones that turn most: to look at all of them from each of them would take the square of their number.
class Spokes {
 public:
  /// For each vertex all of its edges up to this number.
  static constexpr std::size_t kAllUpTo = 64, kOfMore = 32;

  Spokes() = default;
  /// `turns` say how far each edge turns, in one result and in another. The mesh must outlive the object.
  Spokes(const FlatMesh& mesh, const std::vector<float>& turns, const std::vector<float>& others);

  /// Edges; those that do not end at `vertex` have to be passed over.
  std::span<const Index> at(FlatIndex vertex) const;

  /// Visits the edges beyond end number `side` of an edge, with the cosine between going along it and going on along
  /// them. `along` are the directions of all edges.
  template <typename Visit>
  void for_each_beyond(std::size_t edge, std::size_t side, const std::vector<LaneRow>& along, Visit visit) const {
    const FlatIndex vertex = mesh_->edge_ends[side][edge];
    const HalfLanes outward = side == 1 ? along[edge].row : -along[edge].row;
    for (const Index other : at(vertex)) {
      const bool begins = mesh_->edge_ends[0][other] == vertex;
      if (other == edge || (!begins && mesh_->edge_ends[1][other] != vertex)) continue;
      const float product = dot(outward, along[other].row);
      visit(other, begins ? product : -product);
    }
  }

 private:
  const FlatMesh* mesh_ = nullptr;
  std::map<FlatIndex, std::vector<Index>> of_many_;
};

}  // namespace crease
