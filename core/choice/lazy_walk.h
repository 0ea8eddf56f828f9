#pragma once

#include <vector>

#include "core/geometry/surface.h"

namespace crease {

/// The low-pass filter of a lazy random walk over the edges, borders included: a step halves each value and adds half
/// of the mean of its neighbours. `n` steps reach about √n edges far.
class LazyWalk {
 public:
  explicit LazyWalk(const Surface& surface) : surface_(surface) {}

  /// Numbers or vectors, one for each vertex.
  template <typename Value>
  std::vector<Value> after(std::vector<Value> values, int steps) const {
    std::vector<Value> before;
    for (int step = 0; step < steps; ++step) {
      before = values;
      for (std::size_t v = 0; v < values.size(); ++v) {
        const auto edges = surface_.topology.vertex_edges[v];
        if (edges.empty()) continue;
        Value sum = 0 * before[v];
        for (const Index e : edges) sum += before[other_end(surface_.topology.edges[e], static_cast<Index>(v))];
        values[v] = 0.5 * before[v] + 0.5 / static_cast<double>(edges.size()) * sum;
      }
    }
    return values;
  }

 private:
  const Surface& surface_;
};

}  // namespace crease
