#pragma once

#include <array>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "core/base/thread_team.h"
#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

enum class VertexClass : std::uint8_t { kSmooth = 0, kRidge = 1, kCorner = 2 };
inline constexpr std::size_t kVertexClasses = 3;

/// Weights are relative to the evidence of one vertex, which is at most 1 for each class.
struct VertexClassOptions {
  double corner_turn = 70 * (std::numbers::pi / 180);  ///< radians; a ridge that turns by more has a corner
  double along_weight = 0.3;    ///< per label: cost of an edge between a smooth vertex and one of another class
  double corner_weight = 0.05;  ///< per label: cost of an edge between a corner and a ridge vertex
  double across_weight = 0.03;  ///< per 1 − label: cost of an edge between vertices of different classes
};

/// The classification of vertices as smooth, ridge or corner, as a Markov random field (§5, similar to
/// [Lavoué & Wolf 2008]). Sites are the vertices, labels c their classes, and
///
///     E(c) = Σ_v U_v(c_v) + Σ_e [ε_e A(c_i, c_j) + (1 − ε_e) B(c_i, c_j)]
///
/// with the ridge labels ε of the interior edges. Let r₁ ≥ r₂ ≥ r₃ be the three largest at a vertex, and s(θ) ∈ [0, 1]
/// the straightness of a turn by θ (1 well below `corner_turn`, 0 well above). Let r be the second largest label at the
/// far end of the edge of r₁; it tells the end of a line from a stray edge:
///
///     U(smooth) = max(r₂, min(r₁, r))
///     U(ridge)  = max(1 − max over pairs of the three of min(ε, ε') s(θ), r₃)
///     U(corner) = 1 − max(r₃, r₂ (1 − s(θ₁₂)), min(r₁, 1 − r₂, r))
///
/// A and B are metrics: A is `along_weight` between smooth and any other class, and `corner_weight` between ridge and
/// corner; B is `across_weight` between different classes. Boundary and non-manifold edges have neither label nor term:
/// they make no vertex a ridge vertex, and a ridge that meets one ends there in a corner.
class VertexClassField {
 public:
  VertexClassField(const Topology& topology, const std::vector<Vec3>& positions, const std::vector<double>& labels,
                   const VertexClassOptions& options = {}, ThreadTeam& team = calling_thread());

  const Topology& topology() const { return topology_; }
  double unary(Index vertex, VertexClass c) const { return unary_[vertex][static_cast<std::size_t>(c)]; }
  /// The pairwise term of an edge; zero unless it is interior.
  double pairwise(Index edge, VertexClass a, VertexClass b) const;
  double energy(std::span<const VertexClass> classes) const;
  /// The energy with `c` at `vertex` minus the energy of `classes`.
  double delta_energy(std::span<const VertexClass> classes, Index vertex, VertexClass c) const;

 private:
  struct LabelledEnd {
    Index edge = kNone;
    double label = 0;
  };
  using Largest = std::array<LabelledEnd, 3>;

  double label(Index edge) const { return topology_.is_interior(edge) ? labels_[edge] : 0; }
  Largest largest_labels(Index vertex) const;
  double straightness(const std::vector<Vec3>& positions, Index vertex, Index edge, Index other) const;
  std::array<double, kVertexClasses> evidence(const std::vector<Vec3>& positions, const std::vector<Largest>& largest,
                                              Index vertex) const;

  const Topology& topology_;
  const std::vector<double>& labels_;
  VertexClassOptions options_;
  std::vector<std::array<double, kVertexClasses>> unary_;
};

/// Minimises the field by α-expansion [Boykov, Veksler & Zabih 2001], starting from the class with the best unary term
/// at each vertex. The energy never rises. No single expansion can lower the energy of the result, which bounds it by a
/// constant factor of the optimum.
std::vector<VertexClass> classify_vertices(const VertexClassField& field, ThreadTeam& team = calling_thread());
std::vector<VertexClass> classify_vertices(const Topology& topology, const std::vector<Vec3>& positions,
                                           const std::vector<double>& labels, const VertexClassOptions& options = {},
                                           ThreadTeam& team = calling_thread());

}  // namespace crease
