#pragma once

#include <algorithm>

#include "core/base/state_archive.h"

namespace crease {

/// Width of a proposal that follows the acceptance rate from sweep to sweep, and so depends on nothing but the run.
class StepSize {
 public:
  explicit StepSize(double start) : step_(start) {}
  double value() const { return step_; }

  void exchange(StateArchive& archive) { archive.value(step_); }

  void adapt(double acceptance) {
    const double wanted = acceptance > kTargetAcceptance ? step_ * kChange : step_ / kChange;
    step_ = std::clamp(wanted, kSmallest, kLargest);
  }

 private:
  /// [Roberts et al. 1997 give 0.44 for one dimension, 0.23 for many].
  static constexpr double kTargetAcceptance = 0.4;
  static constexpr double kChange = 1.05;
  static constexpr double kSmallest = 1e-5, kLargest = 1.0;

  double step_;
};

}  // namespace crease
