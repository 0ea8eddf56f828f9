#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <vector>

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

 private:
  const FlatMesh* mesh_ = nullptr;
  std::map<FlatIndex, std::vector<Index>> of_many_;
};

}  // namespace crease
