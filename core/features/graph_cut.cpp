#include "core/features/graph_cut.h"

#include <algorithm>

namespace crease {

Index FlowNetwork::add_node() {
  first_.push_back(kNone);
  excess_.push_back(0);
  return static_cast<Index>(excess_.size() - 1);
}

void FlowNetwork::add_terminal(Index node, double from_source, double to_sink) {
  const double old = excess_[node];
  const double source = from_source + std::max(old, 0.0), sink = to_sink + std::max(-old, 0.0);
  terminal_flow_ += std::min(source, sink);
  excess_[node] = source - sink;
}

void FlowNetwork::add_arc(Index tail, Index head, double forward, double backward) {
  const auto number = static_cast<Index>(arcs_.size());
  arcs_.push_back({head, first_[tail], forward});
  first_[tail] = number;
  arcs_.push_back({tail, first_[head], backward});
  first_[head] = number + 1;
}

double FlowNetwork::solve() {
  double flow = terminal_flow_;
  while (update_distances()) {
    current_ = first_;
    for (Index node = 0; node < node_count(); ++node) {
      if (excess_[node] > 0 && distance_[node] != kNone) flow += augment_from(node);
    }
  }
  return flow;
}

/// Searches from the sink, breadth first, against the residual arcs. Returns false if no path from the source is left.
bool FlowNetwork::update_distances() {
  distance_.assign(node_count(), kNone);
  queue_.clear();
  for (Index node = 0; node < node_count(); ++node) {
    if (excess_[node] >= 0) continue;
    distance_[node] = 0;
    queue_.push_back(node);
  }
  bool reaches_source = false;
  for (std::size_t i = 0; i < queue_.size(); ++i) {
    const Index node = queue_[i];
    reaches_source = reaches_source || excess_[node] > 0;
    for (Index arc = first_[node]; arc != kNone; arc = arcs_[arc].next) {
      const Index tail = arcs_[arc].head;
      if (distance_[tail] != kNone || arcs_[arc ^ 1U].residual <= 0) continue;
      distance_[tail] = distance_[node] + 1;
      queue_.push_back(tail);
    }
  }
  return reaches_source;
}

/// Appends the node's next admissible arc to the path. Returns false if there is none.
bool FlowNetwork::advance(Index node) {
  for (Index& arc = current_[node]; arc != kNone; arc = arcs_[arc].next) {
    if (arcs_[arc].residual > 0 && distance_[arcs_[arc].head] + 1 == distance_[node]) {
      path_.push_back(arc);
      return true;
    }
  }
  return false;
}

double FlowNetwork::augment_from(Index start) {
  double flow = 0;
  path_.clear();
  while (excess_[start] > 0) {
    const Index end = path_.empty() ? start : arcs_[path_.back()].head;
    if (excess_[end] < 0) {
      flow += push_along_path();
    } else if (!advance(end)) {
      if (path_.empty()) break;
      const Index dead_end = path_.back();
      path_.pop_back();
      Index& arc = current_[arcs_[dead_end ^ 1U].head];
      arc = arcs_[arc].next;
    }
  }
  return flow;
}

/// Pushes as much flow as the path can take, then cuts the path before its first full arc.
double FlowNetwork::push_along_path() {
  const Index start = arcs_[path_.front() ^ 1U].head, end = arcs_[path_.back()].head;
  double amount = std::min(excess_[start], -excess_[end]);
  for (const Index arc : path_) amount = std::min(amount, arcs_[arc].residual);
  excess_[start] -= amount;
  excess_[end] += amount;
  for (const Index arc : path_) {
    arcs_[arc].residual -= amount;
    arcs_[arc ^ 1U].residual += amount;
  }
  path_.erase(std::find_if(path_.begin(), path_.end(), [&](Index arc) { return arcs_[arc].residual <= 0; }),
              path_.end());
  return amount;
}

void BinaryEnergy::add_unary(Index site, double cost_of_0, double cost_of_1) {
  const double common = std::min(cost_of_0, cost_of_1);
  constant_ += common;
  network_.add_terminal(site, cost_of_1 - common, cost_of_0 - common);
}

void BinaryEnergy::add_pair(Index a, Index b, double cost_00, double cost_01, double cost_10, double cost_11) {
  constant_ += cost_00;
  add_unary(a, 0, cost_10 - cost_00);
  add_unary(b, 0, cost_11 - cost_10);
  network_.add_arc(a, b, std::max(cost_01 + cost_10 - cost_00 - cost_11, 0.0), 0);
}

}  // namespace crease
