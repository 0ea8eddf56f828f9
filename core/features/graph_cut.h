#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh/mesh.h"

namespace crease {

/// Changes of energy below this may be rounding errors, and count as none.
inline constexpr double kNegligible = 1e-9;

/// A flow network between one source and one sink. Dinic's algorithm [Dinic 1970] finds the maximum flow: shortest
/// augmenting paths, phase by phase, with the current-arc rule. It suits the small, shallow networks of local moves,
/// which need few phases. Capacities are finite and not negative.
class FlowNetwork {
 public:
  Index add_node();
  /// Adds to the capacity from the source to `node` and from `node` to the sink.
  void add_terminal(Index node, double from_source, double to_sink);
  /// Adds an arc from `tail` to `head` and its reverse.
  void add_arc(Index tail, Index head, double forward, double backward);

  /// Finds a maximum flow and returns its value. Call once.
  double solve();
  /// Whether `node` is on the sink's side of the minimum cut with the fewest nodes on that side. Call after solve().
  bool on_sink_side(Index node) const { return distance_[node] != kNone; }

  std::size_t node_count() const { return excess_.size(); }

 private:
  struct Arc {
    Index head;
    Index next;  ///< the next arc with the same tail
    double residual;
  };

  bool update_distances();
  double augment_from(Index start);
  double push_along_path();
  bool advance(Index node);

  std::vector<Arc> arcs_;        ///< an arc and its reverse differ in the lowest bit of their number
  std::vector<Index> first_;     ///< the first arc of each node
  std::vector<double> excess_;   ///< residual from the source when positive, to the sink when negative
  std::vector<Index> distance_;  ///< number of residual arcs to a node that touches the sink; kNone when cut off
  std::vector<Index> current_;
  std::vector<Index> path_;  ///< arcs
  std::vector<Index> queue_;
  double terminal_flow_ = 0;  ///< flow from the source over a single node to the sink
};

/// An energy of binary labels with terms of one and two sites. A minimum cut minimises it exactly if every pair is
/// submodular: E(0,0) + E(1,1) ≤ E(0,1) + E(1,0) [Kolmogorov & Zabih 2004].
class BinaryEnergy {
 public:
  Index add_site() { return network_.add_node(); }
  void add_unary(Index site, double cost_of_0, double cost_of_1);
  /// Adds the costs of the labels of (a, b). The pair must be submodular up to rounding; an excess by rounding is
  /// dropped.
  void add_pair(Index a, Index b, double cost_00, double cost_01, double cost_10, double cost_11);

  /// Minimises the energy and returns it. Of several minimisers, takes the one with the fewest ones. Call once.
  double minimise() { return constant_ + network_.solve(); }
  bool label(Index site) const { return network_.on_sink_side(site); }
  std::size_t site_count() const { return network_.node_count(); }

 private:
  FlowNetwork network_;
  double constant_ = 0;
};

}  // namespace crease
