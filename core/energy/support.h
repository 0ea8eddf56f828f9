#pragma once

#include <string_view>
#include <vector>

#include "core/energy/term.h"

namespace crease {

/// −Σ_(e,e') cos θ_ee' ε_e ε_e' over the pairs of edges at a vertex, where θ is the turning angle from one edge to the
/// other. Collinear ridge edges support each other; those that fold back inhibit each other (§3.3).
class SupportTerm {
 public:
  static constexpr std::string_view kName = "support";
  static constexpr int kField = 4;
  static double weight(const MrfOptions& options) { return options.sharpness_weight * options.support_weight; }
  static bool is_used(const MrfOptions& options) { return options.edge_process && weight(options) != 0; }
  explicit SupportTerm(const TermSetup& setup) : sums_(setup.field.positions.size(), Vec3::Zero()) {}

  double energy(const Field& field, ThreadTeam& team) const;
  void positions_changed(const Field& field, ThreadTeam& team);
  void label_set(const Field& field, Index edge, double by);
  double slope(const Field& field, Index edge) const;

 private:
  /// Per vertex, Σ ε_e u_e over its edges, where the unit vectors u_e point away from it. cos θ is minus the cosine
  /// between them, so the other edges of the vertex support edge e by −u_e · (sum − ε_e u_e).
  std::vector<Vec3> sums_;
};

}  // namespace crease
