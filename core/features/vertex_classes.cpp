#include "core/features/vertex_classes.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/features/graph_cut.h"

namespace crease {
namespace {

constexpr std::array kAllClasses = {VertexClass::kSmooth, VertexClass::kRidge, VertexClass::kCorner};
/// Expansions settle in two or three rounds. The limit prevents endless cycles from rounding errors.
constexpr int kMaxRounds = 20;
/// s(θ) falls from 1 to 0 over this many radians on either side of `corner_turn`.
constexpr double kTurnSlack = 15 * (std::numbers::pi / 180);

}  // namespace

VertexClassField::VertexClassField(const Topology& topology, const std::vector<Vec3>& positions,
                                   const std::vector<double>& labels, const VertexClassOptions& options,
                                   ThreadTeam& team)
    : topology_(topology), labels_(labels), options_(options), unary_(positions.size()) {
  std::vector<Largest> largest(positions.size());
  for_each(largest.size(), team, [&](std::size_t v) { largest[v] = largest_labels(static_cast<Index>(v)); });
  for_each(largest.size(), team,
           [&](std::size_t v) { unary_[v] = evidence(positions, largest, static_cast<Index>(v)); });
}

VertexClassField::Largest VertexClassField::largest_labels(Index vertex) const {
  Largest largest;
  for (const Index edge : topology_.vertex_edges[vertex]) {
    LabelledEnd end{edge, label(edge)};
    for (LabelledEnd& place : largest) {
      if (end.label > place.label) std::swap(end, place);
    }
  }
  return largest;
}

double VertexClassField::straightness(const std::vector<Vec3>& positions, Index vertex, Index edge, Index other) const {
  const Vec3 arrival = positions[vertex] - positions[other_end(topology_.edges[edge], vertex)];
  const Vec3 departure = positions[other_end(topology_.edges[other], vertex)] - positions[vertex];
  const double cosine = arrival.stableNormalized().dot(departure.stableNormalized());
  const double turn = std::acos(std::clamp(cosine, -1.0, 1.0));
  return std::clamp(0.5 + (options_.corner_turn - turn) / (2 * kTurnSlack), 0.0, 1.0);
}

std::array<double, kVertexClasses> VertexClassField::evidence(const std::vector<Vec3>& positions,
                                                              const std::vector<Largest>& largest, Index vertex) const {
  const LabelledEnd &first = largest[vertex][0], &second = largest[vertex][1], &third = largest[vertex][2];
  if (first.edge == kNone) return {0, 1, 1};
  double continuation = 0, turn = 0;
  const auto consider_pair = [&](const LabelledEnd& a, const LabelledEnd& b) {
    if (b.edge == kNone) return;
    const double straight = straightness(positions, vertex, a.edge, b.edge);
    continuation = std::max(continuation, b.label * straight);
    if (&b == &second) turn = b.label * (1 - straight);
  };
  consider_pair(first, second);
  consider_pair(first, third);
  consider_pair(second, third);
  const double beyond = largest[other_end(topology_.edges[first.edge], vertex)][1].label;
  const double end = std::min({first.label, 1 - second.label, beyond});
  return {std::max(second.label, std::min(first.label, beyond)), std::max(1 - continuation, third.label),
          1 - std::max({third.label, turn, end})};
}

double VertexClassField::pairwise(Index edge, VertexClass a, VertexClass b) const {
  if (a == b || !topology_.is_interior(edge)) return 0;
  const bool enters_ridge = a == VertexClass::kSmooth || b == VertexClass::kSmooth;
  const double along = enters_ridge ? options_.along_weight : options_.corner_weight;
  return labels_[edge] * along + (1 - labels_[edge]) * options_.across_weight;
}

double VertexClassField::energy(std::span<const VertexClass> classes) const {
  double sum = 0;
  for (Index v = 0; v < classes.size(); ++v) sum += unary(v, classes[v]);
  for (Index e = 0; e < topology_.edges.size(); ++e) {
    sum += pairwise(e, classes[topology_.edges[e].v0], classes[topology_.edges[e].v1]);
  }
  return sum;
}

double VertexClassField::delta_energy(std::span<const VertexClass> classes, Index vertex, VertexClass c) const {
  double delta = unary(vertex, c) - unary(vertex, classes[vertex]);
  for (const Index e : topology_.vertex_edges[vertex]) {
    const VertexClass other = classes[other_end(topology_.edges[e], vertex)];
    delta += pairwise(e, c, other) - pairwise(e, classes[vertex], other);
  }
  return delta;
}

namespace {

/// The best move that changes any set of vertices to class α.
class Expansion {
 public:
  Expansion(const VertexClassField& field, std::vector<VertexClass>& classes, VertexClass alpha, ThreadTeam& team)
      : field_(field), classes_(classes), alpha_(alpha) {
    std::vector<std::uint8_t> is_site(classes.size());
    for_each(is_site.size(), team,
             [&](std::size_t v) { is_site[v] = classes[v] != alpha && may_change(static_cast<Index>(v)) ? 1 : 0; });
    for (Index v = 0; v < is_site.size(); ++v) {
      if (is_site[v] != 0) sites_.push_back(v);
    }
  }

  /// Makes the move. Returns whether the energy fell.
  bool run() {
    if (sites_.empty()) return false;
    site_of_.assign(classes_.size(), kNone);
    for (const Index v : sites_) site_of_[v] = cut_.add_site();
    double before = 0;
    for (const Index v : sites_) before += add_terms(v);
    if (cut_.minimise() > before - kNegligible) return false;
    for (const Index v : sites_) {
      if (cut_.label(site_of_[v])) classes_[v] = alpha_;
    }
    return true;
  }

 private:
  /// False if the unary term of the vertex outweighs anything that its edges could save.
  bool may_change(Index vertex) const {
    double possible = 0;
    for (const Index e : field_.topology().vertex_edges[vertex]) {
      const Edge& edge = field_.topology().edges[e];
      const VertexClass other = classes_[other_end(edge, vertex)];
      possible += std::max(field_.pairwise(e, classes_[vertex], other), field_.pairwise(e, classes_[vertex], alpha_));
    }
    return field_.unary(vertex, alpha_) - field_.unary(vertex, classes_[vertex]) < possible;
  }

  /// Adds the vertex and the edges of which it is the first site. Returns what they cost without a move.
  double add_terms(Index vertex) {
    const VertexClass own = classes_[vertex];
    double stay = field_.unary(vertex, own), change = field_.unary(vertex, alpha_), pairs = 0;
    for (const Index e : field_.topology().vertex_edges[vertex]) {
      const Index neighbour = other_end(field_.topology().edges[e], vertex);
      const VertexClass other = classes_[neighbour];
      if (site_of_[neighbour] == kNone) {
        stay += field_.pairwise(e, own, other);
        change += field_.pairwise(e, alpha_, other);
      } else if (vertex < neighbour) {
        const double both_stay = field_.pairwise(e, own, other);
        cut_.add_pair(site_of_[vertex], site_of_[neighbour], both_stay, field_.pairwise(e, own, alpha_),
                      field_.pairwise(e, alpha_, other), 0);
        pairs += both_stay;
      }
    }
    cut_.add_unary(site_of_[vertex], stay, change);
    return stay + pairs;
  }

  const VertexClassField& field_;
  std::vector<VertexClass>& classes_;
  VertexClass alpha_;
  std::vector<Index> sites_, site_of_;
  BinaryEnergy cut_;
};

}  // namespace

std::vector<VertexClass> classify_vertices(const VertexClassField& field, ThreadTeam& team) {
  std::vector<VertexClass> classes(field.topology().vertex_edges.size());
  for_each(classes.size(), team, [&](std::size_t v) {
    classes[v] = *std::ranges::min_element(kAllClasses, std::less(),
                                           [&](VertexClass c) { return field.unary(static_cast<Index>(v), c); });
  });
  bool fell = true;
  for (int round = 0; fell && round < kMaxRounds; ++round) {
    fell = false;
    for (const VertexClass alpha : kAllClasses) fell = Expansion(field, classes, alpha, team).run() || fell;
  }
  return classes;
}

std::vector<VertexClass> classify_vertices(const Topology& topology, const std::vector<Vec3>& positions,
                                           const std::vector<double>& labels, const VertexClassOptions& options,
                                           ThreadTeam& team) {
  return classify_vertices(VertexClassField(topology, positions, labels, options, team), team);
}

}  // namespace crease
