#include "core/features/ridge_lines.h"

#include <algorithm>

namespace crease {
namespace {

struct Chain {
  std::vector<Index> vertices, edges;
  bool closed = false;
};

/// The graph of the ridge edges. It is traced chain by chain.
class RidgeGraph {
 public:
  RidgeGraph(const Topology& topology, const std::vector<double>& labels, const std::vector<VertexClass>& classes)
      : topology_(topology), labels_(labels), is_end_(classes.size()), traced_(labels.size(), 0) {
    for (Index v = 0; v < is_end_.size(); ++v) {
      const auto ridges = std::ranges::count_if(topology.vertex_edges[v], [&](Index e) { return is_ridge(e); });
      is_end_[v] = ridges != 2 || classes[v] == VertexClass::kCorner ? 1 : 0;
    }
  }

  bool is_untraced_ridge(Index edge) const { return is_ridge(edge) && traced_[edge] == 0; }

  /// Traces the whole chain of an untraced edge, in the order of RidgeLine.
  Chain trace(Index edge) {
    Chain chain;
    chain.edges.push_back(edge);
    traced_[edge] = 1;
    const auto [v0, v1] = topology_.edges[edge];
    chain.vertices.push_back(v0);
    walk(chain);
    chain.closed = chain.vertices.back() == v1;
    if (!chain.closed) {
      std::reverse(chain.vertices.begin(), chain.vertices.end());
      chain.vertices.push_back(v1);
      walk(chain);
      chain.closed = chain.vertices.front() == chain.vertices.back();
      if (chain.closed) chain.vertices.pop_back();
    }
    arrange(chain);
    return chain;
  }

 private:
  bool is_ridge(Index edge) const { return crease::is_ridge(labels_[edge]); }

  /// Extends the chain from its last vertex to an end, or until no edge is left.
  void walk(Chain& chain) {
    for (Index vertex = chain.vertices.back(); is_end_[vertex] == 0; vertex = chain.vertices.back()) {
      const auto edges = topology_.vertex_edges[vertex];
      const auto next = std::ranges::find_if(edges, [&](Index e) { return is_untraced_ridge(e); });
      if (next == edges.end()) return;
      traced_[*next] = 1;
      chain.edges.push_back(*next);
      chain.vertices.push_back(other_end(topology_.edges[*next], vertex));
    }
  }

  void arrange(Chain& chain) const {
    std::vector<Index>& vertices = chain.vertices;
    if (chain.closed) {
      const auto corner = std::ranges::find_if(vertices, [&](Index v) { return is_end_[v] != 0; });
      const auto start = corner != vertices.end() ? corner : std::ranges::min_element(vertices);
      std::rotate(vertices.begin(), start, vertices.end());
      if (vertices.back() < vertices[1]) std::reverse(vertices.begin() + 1, vertices.end());
    } else if (vertices.back() < vertices.front()) {
      std::ranges::reverse(vertices);
    }
  }

  const Topology& topology_;
  const std::vector<double>& labels_;
  std::vector<std::uint8_t> is_end_;  ///< per vertex: chains end here
  std::vector<std::uint8_t> traced_;  ///< per edge
};

}  // namespace

std::vector<RidgeLine> trace_ridges(const Topology& topology, const std::vector<Vec3>& positions,
                                    const std::vector<double>& labels, const std::vector<double>& dihedral_rad,
                                    const std::vector<VertexClass>& classes) {
  std::vector<RidgeLine> lines;
  RidgeGraph graph(topology, labels, classes);
  for (Index first = 0; first < topology.edges.size(); ++first) {
    if (!graph.is_untraced_ridge(first)) continue;
    Chain chain = graph.trace(first);
    RidgeLine& line = lines.emplace_back();
    for (const Index edge : chain.edges) {
      line.length += (positions[topology.edges[edge].v0] - positions[topology.edges[edge].v1]).norm();
      line.mean_label += labels[edge] / static_cast<double>(chain.edges.size());
      line.mean_dihedral_rad += dihedral_rad[edge] / static_cast<double>(chain.edges.size());
    }
    line.vertices = std::move(chain.vertices);
    line.closed = chain.closed;
  }
  return lines;
}

}  // namespace crease
