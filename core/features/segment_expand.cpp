#include <algorithm>
#include <map>
#include <numeric>

#include "core/features/graph_cut.h"
#include "core/features/segment_moves.h"

namespace crease {
namespace {

/// An expansion may take faces up to this many steps from the segment's border.
constexpr int kReach = 4;

/// The edges of each segment's border.
IndexRows border_edges(const SegmentField& field, const std::vector<Index>& segments, std::size_t segment_count) {
  const Topology& topology = field.topology();
  IndexRows rows;
  rows.starts.assign(segment_count + 1, 0);
  const auto for_each_side = [&](auto visit) {
    for (Index e = 0; e < topology.edges.size(); ++e) {
      if (!topology.is_interior(e)) continue;
      const Index a = segments[topology.edge_faces[e][0]], b = segments[topology.edge_faces[e][1]];
      if (a == b) continue;
      visit(a, e);
      visit(b, e);
    }
  };
  for_each_side([&](Index segment, Index) { ++rows.starts[segment + 1]; });
  std::partial_sum(rows.starts.begin(), rows.starts.end(), rows.starts.begin());
  rows.items.resize(rows.starts.back());
  std::vector<Index> next(rows.starts.begin(), rows.starts.end() - 1);
  for_each_side([&](Index segment, Index edge) { rows.items[next[segment]++] = edge; });
  return rows;
}

class LocalExpansion {
 public:
  LocalExpansion(const SegmentField& field, std::vector<Index>& segments, std::size_t segment_count)
      : field_(field), segments_(segments), area_(segment_count, 0), site_of_(segments.size(), kNone) {
    for (Index f = 0; f < segments.size(); ++f) area_[segments[f]] += field.area(f);
  }

  void run(Index alpha, std::span<const Index> border) {
    cut_ = BinaryEnergy();
    gather(alpha, border);
    if (sites_.empty()) return;
    double before = 0;
    for (const Index f : sites_) before += add_terms(f, alpha);
    const double after = cut_.minimise();
    if (after < before - kNegligible && after + change_of_smallness(alpha) < before - kNegligible) apply(alpha);
    for (const Index f : sites_) site_of_[f] = kNone;
  }

 private:
  bool moves(Index face) const { return cut_.label(site_of_[face]); }

  /// Makes sites of the faces beside the segment and of faces a few steps further away.
  void gather(Index alpha, std::span<const Index> border) {
    sites_.clear();
    const auto add = [&](Index face) {
      if (segments_[face] == alpha || site_of_[face] != kNone) return;
      site_of_[face] = cut_.add_site();
      sites_.push_back(face);
    };
    for (const Index e : border) {
      const auto [f0, f1] = field_.topology().edge_faces[e];
      if (segments_[f0] == alpha) add(f1);
      if (segments_[f1] == alpha) add(f0);
    }
    std::size_t begin = 0;
    for (int step = 1; step < kReach; ++step) {
      const std::size_t end = sites_.size();
      for (; begin < end; ++begin) {
        for_each_neighbour(field_, sites_[begin], [&](Index, Index other) { add(other); });
      }
    }
  }

  /// Adds the face and its edges to later sites. Returns what they cost without a move.
  double add_terms(Index face, Index alpha) {
    const Index own = segments_[face], site = site_of_[face];
    double stay = 0, change = 0, pairs = 0;
    for_each_neighbour(field_, face, [&](Index edge, Index other) {
      const double cost = field_.border_cost(edge);
      const bool differs = segments_[other] != own;
      if (site_of_[other] == kNone) {
        stay += differs ? cost : 0;
        change += segments_[other] != alpha ? cost : 0;
      } else if (cost < 0) {
        // No cut can reward a border. With m = 1 where a face moves, cost + |cost| m m' ≤ cost + |cost| (m + m')/2
        // where there is one now, and cost [m ≠ m'] ≤ 0 where there is none.
        stay += differs ? cost / 2 : 0;
      } else if (site < site_of_[other]) {
        cut_.add_pair(site, site_of_[other], differs ? cost : 0, cost, cost, 0);
        pairs += differs ? cost : 0;
      }
    });
    cut_.add_unary(site, stay, change);
    return stay + pairs;
  }

  double change_of_smallness(Index alpha) const {
    std::map<Index, double> areas = {{alpha, area_[alpha]}};
    for (const Index f : sites_) {
      if (!moves(f)) continue;
      areas.try_emplace(segments_[f], area_[segments_[f]]).first->second -= field_.area(f);
      areas[alpha] += field_.area(f);
    }
    double change = 0;
    for (const auto& [segment, area] : areas) {
      const bool gone = area < kNegligible;
      change += (gone ? 0 : field_.smallness(area)) - field_.smallness(area_[segment]);
    }
    return change;
  }

  void apply(Index alpha) {
    for (const Index f : sites_) {
      if (!moves(f)) continue;
      area_[segments_[f]] -= field_.area(f);
      area_[alpha] += field_.area(f);
      segments_[f] = alpha;
    }
  }

  const SegmentField& field_;
  std::vector<Index>& segments_;
  std::vector<double> area_;  ///< per segment
  std::vector<Index> site_of_;
  std::vector<Index> sites_;
  BinaryEnergy cut_;
};

}  // namespace

void expand_segments(const SegmentField& field, std::vector<Index>& segments) {
  if (segments.empty()) return;
  const std::size_t count = *std::ranges::max_element(segments) + std::size_t{1};
  const IndexRows borders = border_edges(field, segments, count);
  LocalExpansion expansion(field, segments, count);
  for (Index alpha = 0; alpha < count; ++alpha) expansion.run(alpha, borders[alpha]);
}

}  // namespace crease
