#pragma once

#include <string_view>

#include "core/energy/term.h"

namespace crease {

/// Σ_(e,e') cos θ_ee' (φ_e − φ_e')² ε_e ε_e' over the pairs of edges at a vertex whose turn θ is less than a right
/// angle. It makes the dihedral angle change slowly along a ridge line (§3.3).
class ContinuityTerm {
 public:
  static constexpr std::string_view kName = "continuity";
  static constexpr int kField = 7;
  static double weight(const MrfOptions& options) { return options.continuity_weight; }
  static bool is_used(const MrfOptions& options) { return options.edge_process && weight(options) != 0; }
  explicit ContinuityTerm(const TermSetup&) {}

  double energy(const Field& field, ThreadTeam& team) const;
  double slope(const Field& field, Index edge) const;
};

}  // namespace crease
