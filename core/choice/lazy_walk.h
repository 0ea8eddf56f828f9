#pragma once

#include <vector>

#include "core/base/thread_team.h"
#include "core/geometry/surface.h"

namespace crease {

/// The low-pass filter of a lazy random walk over the edges, borders included: a step halves each value and adds half
/// of the mean of its neighbours. `n` steps reach about √n edges far.
class LazyWalk {
 public:
  /// The team must outlive the object.
  LazyWalk(const Surface& surface, ThreadTeam& team) : team_(team) {
    begins_.push_back(0);
    for (std::size_t v = 0; v < surface.measured.size(); ++v) {
      for (const Index e : surface.topology.vertex_edges[v]) {
        neighbors_.push_back(other_end(surface.topology.edges[e], static_cast<Index>(v)));
      }
      begins_.push_back(neighbors_.size());
    }
  }

  /// Numbers or vectors, one for each vertex.
  template <typename Value>
  std::vector<Value> after(std::vector<Value> values, int steps) const {
    std::vector<Value> next = values;
    for (int step = 0; step < steps; ++step) {
      team_.run(values.size(), kChunk, [&](std::size_t first, std::size_t last, std::size_t) {
        for (std::size_t v = first; v < last; ++v) next[v] = stepped(values, v);
      });
      values.swap(next);
    }
    return values;
  }

 private:
  template <typename Value>
  Value stepped(const std::vector<Value>& values, std::size_t v) const {
    const std::size_t begin = begins_[v], end = begins_[v + 1];
    if (begin == end) return values[v];
    Value sum = values[neighbors_[begin]];
    for (std::size_t i = begin + 1; i < end; ++i) sum += values[neighbors_[i]];
    return 0.5 * values[v] + 0.5 / static_cast<double>(end - begin) * sum;
  }

  ThreadTeam& team_;
  std::vector<std::size_t> begins_;  ///< per vertex, and the end: where its neighbours are
  std::vector<Index> neighbors_;
};

}  // namespace crease
