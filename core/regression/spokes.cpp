#include "core/regression/spokes.h"

#include <algorithm>
#include <utility>

namespace crease {

Spokes::Spokes(const FlatMesh& mesh, const std::vector<float>& turns, const std::vector<float>& others) : mesh_(&mesh) {
  for (std::size_t v = 0; v < mesh.vertex_count; ++v) {
    const auto around = mesh.vertex_stencils[v];
    if (around.size() <= 2 * kAllUpTo) continue;  // the edges that end here, and as many opposite
    const auto vertex = static_cast<FlatIndex>(v);
    std::vector<std::pair<float, Index>> ends;
    for (const Index e : around) {
      const bool ends_here = mesh.edge_ends[0][e] == vertex || mesh.edge_ends[1][e] == vertex;
      if (ends_here) ends.emplace_back(-std::max(turns[e], others[e]), e);
    }
    const std::size_t count = std::min(kOfMore, ends.size());
    std::ranges::partial_sort(ends, ends.begin() + static_cast<std::ptrdiff_t>(count));
    std::vector<Index>& most = of_many_[vertex];
    for (std::size_t i = 0; i < count; ++i) most.push_back(ends[i].second);
  }
}

std::span<const Index> Spokes::at(FlatIndex vertex) const {
  const auto around = mesh_->vertex_stencils[static_cast<std::size_t>(vertex)];
  if (around.size() <= 2 * kAllUpTo) return around;
  return of_many_.at(vertex);
}

}  // namespace crease
