#pragma once

#include <string_view>

namespace crease {

/// A potential and how it is graduated: its exponent goes from `exponent_start` to `exponent_end` while the descent
/// anneals, in steps of a quarter, its scale from 0.1 to `scale`. The scale of an edge grows with what its surroundings
/// bend, so that one potential is sparse on flats and quadratic on curved parts:
///
///     c_e² = scale² + local_gain · local mean of q/(1 + q/ridge_cap),    w_e = |e| (0.1/c_e)^(weight_power − 1)
struct PotentialFamily {
  std::string_view name;
  float exponent_end = 1, exponent_start = 1;
  float scale = 0.02F;
  float local_gain = 0;
  float weight_power = 1;  ///< 1 or 2
  float ridge_cap = 0.1F;  ///< ‖n_i − n_j‖² from which on an edge is a ridge and bends nothing around it
  float ramp = 1;          ///< by how much the likelihood weighs more at the start; keeps ridges until they are sharp
  /// From this stage on, the likelihood pulls towards the result of the stage before instead of the measured positions.
  /// Each stage is then a step of a diffusion, which keeps broad shapes better than one step of the same strength.
  int diffuses_from = kNever;

  static constexpr int kNever = 1000;
  bool diffuses() const { return diffuses_from < kNever; }
  bool diffuses_throughout() const { return diffuses_from == 1; }
};

}  // namespace crease
