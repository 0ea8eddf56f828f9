#include "core/io/corner_fans.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace crease {

CornerRows::CornerRows(const Mesh& mesh) : mesh_(mesh), starts_(mesh.positions.size() + 1, 0) {
  for (const Triangle& triangle : mesh.triangles) {
    for (const Index vertex : triangle) ++starts_[vertex + 1];
  }
  std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
  places_.resize(3 * mesh.triangles.size());
  std::vector<std::size_t> next(starts_.begin(), starts_.end() - 1);
  for (std::size_t i = 0; i < places_.size(); ++i) places_[next[mesh.triangles[i / 3][i % 3]]++] = i;
}

void CornerRows::read(std::size_t vertex, std::vector<Corner>& corners) const {
  corners.clear();
  for (std::size_t i = starts_[vertex]; i < starts_[vertex + 1]; ++i) {
    const std::size_t face = places_[i] / 3, place = places_[i] % 3;
    const Triangle& triangle = mesh_.triangles[face];
    corners.push_back({face, place, triangle[(place + 1) % 3], triangle[(place + 2) % 3]});
  }
}

IndexRows ridge_ends(const LabelledMesh& result) {
  IndexRows rows;
  rows.starts.assign(result.mesh.positions.size() + 1, 0);
  const auto for_each_end = [&](auto visit) {
    for (std::size_t edge = 0; edge < result.edges.size(); ++edge) {
      if (!is_ridge(result.labels[edge])) continue;
      visit(result.edges[edge].v0, result.edges[edge].v1);
      visit(result.edges[edge].v1, result.edges[edge].v0);
    }
  };
  for_each_end([&](Index from, Index) { ++rows.starts[from + 1]; });
  std::partial_sum(rows.starts.begin(), rows.starts.end(), rows.starts.begin());
  rows.items.resize(rows.starts.back());
  std::vector<Index> next(rows.starts.begin(), rows.starts.end() - 1);
  for_each_end([&](Index from, Index to) { rows.items[next[from]++] = to; });
  for (std::size_t row = 0; row < rows.size(); ++row) {
    std::sort(rows.items.begin() + rows.starts[row], rows.items.begin() + rows.starts[row + 1]);
  }
  return rows;
}

const std::vector<std::size_t>& FanFinder::find(Index vertex, const std::vector<Corner>& corners,
                                                std::span<const Index> ridges, std::span<const Index> segments) {
  fans_.resize(corners.size());
  std::iota(fans_.begin(), fans_.end(), std::size_t{0});
  spokes_.clear();
  for (std::size_t corner = 0; corner < corners.size(); ++corner) {
    if (corners[corner].next != vertex) spokes_.push_back({corners[corner].next, corner, true});
    if (corners[corner].previous != vertex) spokes_.push_back({corners[corner].previous, corner, false});
  }
  std::sort(spokes_.begin(), spokes_.end(), [](const Spoke& a, const Spoke& b) {
    return std::tie(a.to, a.corner, a.outgoing) < std::tie(b.to, b.corner, b.outgoing);
  });
  for (auto first = spokes_.begin(); first != spokes_.end();) {
    const auto last = std::find_if(first, spokes_.end(), [&](const Spoke& spoke) { return spoke.to != first->to; });
    const bool joins = last - first == 2 && first->outgoing != (first + 1)->outgoing;
    const auto segment = [&](const Spoke& spoke) { return segments[corners[spoke.corner].face]; };
    const bool parts = joins && !segments.empty() && segment(*first) != segment(*(first + 1));
    if (joins && !parts && !std::binary_search(ridges.begin(), ridges.end(), first->to)) {
      const std::size_t a = root(first->corner), b = root((first + 1)->corner);
      fans_[std::max(a, b)] = std::min(a, b);
    }
    first = last;
  }
  for (std::size_t corner = 0; corner < fans_.size(); ++corner) fans_[corner] = root(corner);
  return fans_;
}

std::size_t FanFinder::root(std::size_t corner) {
  while (fans_[corner] != corner) corner = fans_[corner] = fans_[fans_[corner]];
  return corner;
}

}  // namespace crease
