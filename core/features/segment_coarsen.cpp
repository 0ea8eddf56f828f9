#include <algorithm>
#include <numeric>
#include <utility>

#include "core/features/graph_cut.h"
#include "core/features/segment_moves.h"

namespace crease {
namespace {

class Coarsening {
 public:
  Coarsening(const SegmentField& field, std::vector<Index>& segments)
      : segments_(segments), region_count_(segments.empty() ? 0 : *std::ranges::max_element(segments) + 1) {
    const Topology& topology = field.topology();
    for (Index e = 0; e < topology.edges.size(); ++e) {
      if (!topology.is_interior(e)) continue;
      const auto [a, b] = std::minmax(segments[topology.edge_faces[e][0]], segments[topology.edge_faces[e][1]]);
      if (a != b) borders_.push_back({a, b, field.border_cost(e)});
    }
    add_up_borders();
  }

  std::vector<SegmentBorder> run() {
    while (contract() * kWorthwhile > region_count_) {
    }
    return std::move(borders_);
  }

 private:
  static constexpr Index kWorthwhile = 20;

  /// Joins the borders between the same two segments.
  void add_up_borders() {
    sort_borders();
    std::size_t last = 0;
    for (std::size_t i = 1; i < borders_.size(); ++i) {
      if (borders_[i].a == borders_[last].a && borders_[i].b == borders_[last].b) {
        borders_[last].cost += borders_[i].cost;
      } else {
        borders_[++last] = borders_[i];
      }
    }
    if (!borders_.empty()) borders_.resize(last + 1);
  }

  /// By their first segment, which a counting sort is fast for, then by their second.
  void sort_borders() {
    std::vector<std::size_t> next(region_count_ + std::size_t{1}, 0);
    for (const SegmentBorder& border : borders_) ++next[border.a + std::size_t{1}];
    std::partial_sum(next.begin(), next.end(), next.begin());
    std::vector<SegmentBorder> sorted(borders_.size());
    for (const SegmentBorder& border : borders_) sorted[next[border.a]++] = border;
    auto begin = sorted.begin();
    for (std::size_t a = 0; a + 1 < next.size(); ++a) {
      const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(next[a]);
      std::ranges::sort(begin, end, {}, &SegmentBorder::b);
      begin = end;
    }
    borders_ = std::move(sorted);
  }

  /// Breaks ties in a scattered order. In the order of the mesh, a chain of equal borders would lose only one per
  /// round.
  static std::uint64_t scrambled(const SegmentBorder& border) {
    const std::uint64_t mixed = (std::uint64_t{border.a} << 32 | border.b) * 0x9e3779b97f4a7c15U;
    return (mixed ^ mixed >> 29) * 0xbf58476d1ce4e5b9U;
  }

  static bool is_better(const SegmentBorder& border, const SegmentBorder& than) {
    return border.cost != than.cost ? border.cost > than.cost : scrambled(border) > scrambled(than);
  }

  /// For each region the border whose removal saves most; kNone where none saves anything.
  std::vector<Index> best_borders() const {
    std::vector<Index> best(region_count_, kNone);
    for (Index i = 0; i < borders_.size(); ++i) {
      if (borders_[i].cost <= kNegligible) continue;
      for (const Index region : {borders_[i].a, borders_[i].b}) {
        if (best[region] == kNone || is_better(borders_[i], borders_[best[region]])) best[region] = i;
      }
    }
    return best;
  }

  /// Does one round. Returns the number of pairs that were contracted.
  Index contract() {
    const std::vector<Index> best = best_borders();
    std::vector<Index> renamed(region_count_, kNone);
    Index next = 0;
    for (Index r = 0; r < region_count_; ++r) {
      if (renamed[r] != kNone) continue;
      renamed[r] = next++;
      if (best[r] == kNone) continue;
      const SegmentBorder& border = borders_[best[r]];
      const Index other = border.a == r ? border.b : border.a;
      if (best[other] == best[r]) renamed[other] = renamed[r];
    }
    rename(renamed);
    return std::exchange(region_count_, next) - next;
  }

  void rename(const std::vector<Index>& renamed) {
    for (Index& segment : segments_) segment = renamed[segment];
    for (SegmentBorder& border : borders_) {
      const auto [a, b] = std::minmax(renamed[border.a], renamed[border.b]);
      border.a = a;
      border.b = b;
    }
    std::erase_if(borders_, [](const SegmentBorder& border) { return border.a == border.b; });
    add_up_borders();
  }

  std::vector<Index>& segments_;
  Index region_count_;
  std::vector<SegmentBorder> borders_;
};

}  // namespace

std::vector<SegmentBorder> coarsen_segments(const SegmentField& field, std::vector<Index>& segments) {
  return Coarsening(field, segments).run();
}

}  // namespace crease
