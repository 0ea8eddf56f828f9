#include <algorithm>
#include <map>
#include <queue>
#include <span>

#include "core/features/graph_cut.h"
#include "core/features/segment_moves.h"

namespace crease {
namespace {

/// A pair of neighbours with the cost of its border when it was queued.
struct Candidate {
  double border_cost;
  Index a, b;  ///< a < b
  /// The most expensive border comes out of the queue first.
  bool operator<(const Candidate& other) const {
    if (border_cost != other.border_cost) return border_cost < other.border_cost;
    return a != other.a ? a > other.a : b > other.b;
  }
};

class RegionGraph {
 public:
  RegionGraph(const SegmentField& field, const std::vector<Index>& segments, std::span<const SegmentBorder> borders)
      : field_(field), parent_(segments.empty() ? 0 : *std::ranges::max_element(segments) + std::size_t{1}) {
    area_.assign(parent_.size(), 0);
    borders_.resize(parent_.size());
    for (Index r = 0; r < parent_.size(); ++r) parent_[r] = r;
    for (Index f = 0; f < segments.size(); ++f) area_[segments[f]] += field.area(f);
    for (const auto& [a, b, cost] : borders) borders_[a][b] = borders_[b][a] = cost;
  }

  void merge_while_it_saves() {
    for (Index r = 0; r < borders_.size(); ++r) {
      for (const auto& [neighbour, cost] : borders_[r]) {
        if (r < neighbour) enqueue(r, neighbour, cost);
      }
    }
    while (!queue_.empty()) {
      const Candidate best = queue_.top();
      queue_.pop();
      if (still_saves(best)) merge(best.a, best.b);
    }
  }

  Index root(Index region) {
    while (parent_[region] != region) region = parent_[region] = parent_[parent_[region]];
    return region;
  }

 private:
  /// The share of the sizes only falls. A saving that is not positive stays so until the border changes.
  double saving(Index a, Index b, double border_cost) const {
    return border_cost + field_.smallness(area_[a]) + field_.smallness(area_[b]) -
           field_.smallness(area_[a] + area_[b]);
  }

  void enqueue(Index a, Index b, double border_cost) {
    if (saving(a, b, border_cost) > kNegligible) queue_.push({border_cost, std::min(a, b), std::max(a, b)});
  }

  bool still_saves(const Candidate& pair) const {
    const auto border = borders_[pair.a].find(pair.b);
    return border != borders_[pair.a].end() && border->second == pair.border_cost &&
           saving(pair.a, pair.b, pair.border_cost) > kNegligible;
  }

  /// Merges into the region with more neighbours. Each border then moves at most a logarithmic number of times.
  void merge(Index a, Index b) {
    if (borders_[a].size() < borders_[b].size()) std::swap(a, b);
    parent_[b] = a;
    area_[a] += area_[b];
    borders_[a].erase(b);
    borders_[b].erase(a);
    for (const auto& [neighbour, cost] : borders_[b]) {
      const double sum = borders_[a][neighbour] += cost;
      borders_[neighbour].erase(b);
      borders_[neighbour][a] = sum;
      enqueue(a, neighbour, sum);
    }
    borders_[b].clear();
  }

  const SegmentField& field_;
  std::vector<Index> parent_;
  std::vector<double> area_;
  std::vector<std::map<Index, double>> borders_;  ///< per region, the cost of the border to each neighbour
  std::priority_queue<Candidate> queue_;
};

}  // namespace

void merge_segments(const SegmentField& field, std::vector<Index>& segments) {
  const std::vector<SegmentBorder> borders = coarsen_segments(field, segments);
  RegionGraph graph(field, segments, borders);
  graph.merge_while_it_saves();
  for (Index& segment : segments) segment = graph.root(segment);
}

}  // namespace crease
