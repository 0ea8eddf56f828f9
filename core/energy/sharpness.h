#pragma once

#include <string_view>

#include "core/energy/term.h"

namespace crease {

/// Σ_e (φ₀ − φ_e) ε_e: an edge with an angle beyond the threshold is a ridge (§3.3). Curvature clamping (§5, Fig. 5)
/// turns the angle of an edge that may be no ridge.
class SharpnessTerm {
 public:
  static constexpr std::string_view kName = "sharpness";
  static constexpr int kField = 3;
  static double weight(const MrfOptions& options) { return options.sharpness_weight; }
  static bool is_used(const MrfOptions& options) { return options.edge_process && weight(options) != 0; }
  explicit SharpnessTerm(const TermSetup& setup);

  double energy(const Field& field, ThreadTeam& team) const;
  double slope(const Field& field, Index edge) const { return threshold_ - angle(field.edges.angle[edge]); }

  /// φ of a signed dihedral angle: its size, negative and so never sharp enough for an edge that may be no ridge.
  double angle(double dihedral) const;

 private:
  double threshold_, limit_;
  RidgeKind ridge_kind_;
};

}  // namespace crease
