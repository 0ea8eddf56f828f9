#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/mesh.h"

namespace crease {

/// Breadth-first walks over numbered sites, one after the other without clearing or allocating in between.
class Walk {
 public:
  explicit Walk(std::size_t sites) : seen_in_(sites, 0) {}

  /// The seeds and all sites `inside` that connect to them, nearest first; valid until the next walk.
  /// `visit_neighbors(site, visit)` calls `visit` for the sites next to `site`.
  template <typename VisitNeighbors, typename Inside>
  std::span<const Index> from(std::span<const Index> seeds, VisitNeighbors visit_neighbors, Inside inside) {
    ++walk_;
    reached_.clear();
    const auto reach = [&](Index site) {
      seen_in_[site] = walk_;
      reached_.push_back(site);
    };
    for (const Index seed : seeds) reach(seed);
    for (std::size_t next = 0; next < reached_.size(); ++next) {
      visit_neighbors(reached_[next], [&](Index site) {
        if (seen_in_[site] != walk_ && inside(site)) reach(site);
      });
    }
    return reached_;
  }

 private:
  std::vector<std::uint64_t> seen_in_;
  std::uint64_t walk_ = 0;
  std::vector<Index> reached_;
};

}  // namespace crease
