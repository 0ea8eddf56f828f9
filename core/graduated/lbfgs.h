#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/base/thread_team.h"

namespace crease {

/// A function of flat arrays with its gradient.
using DifferentiableFunction = std::function<double(std::span<const float> x, std::span<float> gradient)>;

struct LbfgsOptions {
  int steps = 50;
  double least_gain = 1e-5;  ///< relative; three smaller ones in a row end the search
  float first_move = 0.1F;   ///< of the vertex that moves farthest in a step without a history
  float longest_move = 0;    ///< of any vertex in a step; 0: any
  bool goes_on = false;      ///< begin with the last step of the search before, and leave one for the next
  /// Called after the first evaluation, before the first step: what is known there may make the first metric, which is
  /// one of the next two, or the identity.
  std::function<void()> on_start = {};
  /// One number for each of `x`, up to a factor, which the last step tells.
  const std::vector<float>* diagonal = nullptr;
  /// Replaces a gradient by what it is worth as a step.
  std::function<void(std::span<float>)> solve = {};
};

/// A step of a search, and the change of the gradient over it; both empty for none.
struct LbfgsStep {
  std::vector<float> step, change;
};

/// What searches in a row share.
struct LbfgsMemory {
  std::vector<std::vector<float>> vectors;  ///< to work in: the system takes its time to hand out so much
  LbfgsStep last;                           ///< of the search before, if that was told to leave it
};

/// Minimises by limited-memory BFGS [Liu & Nocedal 1989] with backtracking along a parabola, from `x` to `x`. The same
/// bits for any number of threads. Returns the value at the end.
double minimize(const DifferentiableFunction& function, std::vector<float>& x, const LbfgsOptions& options,
                ThreadTeam& team, LbfgsMemory& memory);

}  // namespace crease
