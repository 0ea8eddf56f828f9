#include <algorithm>

#include "core/features/segment_moves.h"

namespace crease {
namespace {

/// Floods the faces by their distance from ridges, the farthest first.
class Watershed {
 public:
  explicit Watershed(const SegmentField& field) : field_(field), basin_(field.face_count(), kNone) {}

  std::vector<Index> flood() {
    const auto levels = faces_by_level();
    for (auto level = levels.rbegin(); level != levels.rend(); ++level) {
      extend_basins(*level);
      open_basins(*level);
    }
    return std::move(basin_);
  }

  /// Floods the highest level only; every other face is a basin of its own.
  std::vector<Index> flood_far_faces() {
    const std::vector<Index> far = faces_by_level().back();
    in_level_.assign(basin_.size(), 0);
    for (const Index f : far) in_level_[f] = 1;
    open_basins(far);
    for (Index& basin : basin_) {
      if (basin == kNone) basin = count_++;
    }
    return std::move(basin_);
  }

 private:
  std::vector<std::vector<Index>> faces_by_level() const {
    std::vector<std::vector<Index>> levels(field_.options().gap_rings + 1);
    for (Index f = 0; f < basin_.size(); ++f) levels[level_of(f)].push_back(f);
    return levels;
  }

  std::uint32_t level_of(Index face) const {
    std::uint32_t least = field_.options().gap_rings;
    for (const Index e : field_.topology().face_edges[face]) {
      if (e == kNone) continue;
      const auto [v0, v1] = field_.topology().edges[e];
      least = std::min({least, field_.rings_from_ridges(v0), field_.rings_from_ridges(v1)});
    }
    return least;
  }

  /// Adds the level's faces to the basins that they touch, ring by ring.
  void extend_basins(const std::vector<Index>& level) {
    std::vector<Index> ring;
    for (const Index f : level) {
      if (touched_basin(f) != kNone) ring.push_back(f);
    }
    in_level_.assign(basin_.size(), 0);
    for (const Index f : level) in_level_[f] = 1;
    std::vector<Index> basins, next;
    while (!ring.empty()) {
      basins.clear();
      for (const Index f : ring) basins.push_back(touched_basin(f));
      for (std::size_t i = 0; i < ring.size(); ++i) basin_[ring[i]] = basins[i];
      next.clear();
      for (const Index f : ring) {
        for_each_passage(f, [&](Index, Index other) {
          if (basin_[other] == kNone && in_level_[other] == 1) {
            in_level_[other] = 2;
            next.push_back(other);
          }
        });
      }
      ring.swap(next);
    }
  }

  /// Opens a basin for each connected part of the level's remaining faces.
  void open_basins(const std::vector<Index>& level) {
    std::vector<Index> queue;
    for (const Index seed : level) {
      if (basin_[seed] != kNone) continue;
      basin_[seed] = count_;
      queue.assign(1, seed);
      for (std::size_t i = 0; i < queue.size(); ++i) {
        for_each_passage(queue[i], [&](Index, Index other) {
          if (basin_[other] != kNone || in_level_[other] == 0) return;
          basin_[other] = count_;
          queue.push_back(other);
        });
      }
      ++count_;
    }
  }

  /// The neighbouring basin across the edge where a border would cost most; kNone if no neighbour is in a basin.
  Index touched_basin(Index face) const {
    Index basin = kNone;
    double highest = 0;
    for_each_passage(face, [&](Index edge, Index other) {
      if (basin_[other] == kNone || (basin != kNone && field_.border_cost(edge) <= highest)) return;
      basin = basin_[other];
      highest = field_.border_cost(edge);
    });
    return basin;
  }

  template <typename Visit>
  void for_each_passage(Index face, Visit visit) const {
    for_each_neighbour(field_, face, [&](Index edge, Index other) {
      if (!field_.is_ridge(edge)) visit(edge, other);
    });
  }

  const SegmentField& field_;
  std::vector<Index> basin_;  ///< per face
  std::vector<std::uint8_t> in_level_;
  Index count_ = 0;
};

}  // namespace

std::vector<Index> seed_segments(const SegmentField& field) { return Watershed(field).flood(); }

std::vector<Index> seed_faces(const SegmentField& field) { return Watershed(field).flood_far_faces(); }

Index split_segments(const SegmentField& field, std::vector<Index>& segments) {
  std::vector<Index> parts(segments.size(), kNone), queue;
  Index count = 0;
  for (Index seed = 0; seed < parts.size(); ++seed) {
    if (parts[seed] != kNone) continue;
    parts[seed] = count;
    queue.assign(1, seed);
    for (std::size_t i = 0; i < queue.size(); ++i) {
      for (const Index other : field.neighbors(queue[i])) {
        if (other == kNone || parts[other] != kNone || segments[other] != segments[seed]) continue;
        parts[other] = count;
        queue.push_back(other);
      }
    }
    ++count;
  }
  segments = std::move(parts);
  return count;
}

}  // namespace crease
