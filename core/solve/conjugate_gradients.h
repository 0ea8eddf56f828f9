#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/base/state_archive.h"
#include "core/base/thread_team.h"

namespace crease {

/// Nonlinear conjugate gradients [Polak & Ribière 1969, restarted where β < 0] with a line search that fits a parabola,
/// over points in space: arrays of 3·points numbers, all x first, then all y, then all z.
class ConjugateGradients {
 public:
  /// The value of the function at `x`, with its gradient.
  using Function = std::function<double(std::span<const double> x, std::span<double> gradient)>;

  explicit ConjugateGradients(std::size_t size);

  /// One step of `x` to a lower value, if there is one along the search direction. False when there is none even along
  /// the gradient, which is as good as a minimum.
  bool step(std::vector<double>& x, const Function& function, ThreadTeam& team);

  /// Must be called before step() when the function has changed, or `x` by anything but step().
  void function_changed() { is_evaluated_ = false; }

  void exchange(StateArchive& archive);

 private:
  struct Trial {
    std::vector<double> x, gradient;
    double value = 0;
  };

  void turn_search(ThreadTeam& team);
  void try_step(const std::vector<double>& x, double length, const Function& function, Trial& trial,
                ThreadTeam& team) const;
  bool descend(std::vector<double>& x, const Function& function, ThreadTeam& team);
  double first_length() const;

  std::vector<double> gradient_, previous_, search_;
  double value_ = 0, slope_ = 0, last_decrease_ = 0;
  bool is_evaluated_ = false;  ///< value and gradient are those at x
  bool is_steepest_ = true, restarts_ = true;
  Trial first_, second_;
};

}  // namespace crease
