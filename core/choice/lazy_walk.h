#pragma once

#include <vector>

#include "core/geometry/surface.h"

namespace crease {

/// The low-pass filter of a lazy random walk over the edges, borders included: a step halves each value and adds half
/// of the mean of its neighbours. `n` steps reach about √n edges far.
class LazyWalk {
 public:
  explicit LazyWalk(const Surface& surface) {
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
      for (std::size_t v = 0; v < values.size(); ++v) {
        const std::size_t begin = begins_[v], end = begins_[v + 1];
        if (begin == end) continue;
        Value sum = values[neighbors_[begin]];
        for (std::size_t i = begin + 1; i < end; ++i) sum += values[neighbors_[i]];
        next[v] = 0.5 * values[v] + 0.5 / static_cast<double>(end - begin) * sum;
      }
      values.swap(next);
    }
    return values;
  }

 private:
  std::vector<std::size_t> begins_;  ///< per vertex, and the end: where its neighbours are
  std::vector<Index> neighbors_;
};

}  // namespace crease
