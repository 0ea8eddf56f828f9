#pragma once

#include <string_view>

#include "core/energy/term.h"

namespace crease {

/// Σ_e (φ₀ − φ_e) ε_e: it labels the edges whose angle exceeds the threshold φ₀ as ridges (§3.3). Curvature clamping
/// (§5, Fig. 5) negates the angle of edges that must not be ridges.
class SharpnessTerm {
 public:
  static constexpr std::string_view kName = "sharpness";
  static constexpr int kField = 3;
  static double weight(const MrfOptions& options) { return options.sharpness_weight; }
  static bool is_used(const MrfOptions& options) { return options.edge_process && weight(options) != 0; }
  explicit SharpnessTerm(const TermSetup& setup);

  double energy(const Field& field, ThreadTeam& team) const;
  double slope(const Field& field, Index edge) const { return threshold_ - angle(field.edges.angle[edge]); }

  /// φ for a signed dihedral angle: its absolute value, negated if the edge must not be a ridge.
  double angle(double dihedral) const;

 private:
  double threshold_, limit_;
  RidgeKind ridge_kind_;
};

}  // namespace crease
