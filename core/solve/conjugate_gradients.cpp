#include "core/solve/conjugate_gradients.h"

#include <algorithm>
#include <cmath>

namespace crease {
namespace {

constexpr int kMostTrials = 12;

double dot(const std::vector<double>& a, const std::vector<double>& b, ThreadTeam& team) {
  return block_sum<double>(a.size(), team, [&](std::size_t i) { return a[i] * b[i]; });
}

}  // namespace

ConjugateGradients::ConjugateGradients(std::size_t size) : gradient_(size, 0), previous_(size, 0), search_(size, 0) {
  for (Trial* trial : {&first_, &second_}) {
    trial->x.resize(size);
    trial->gradient.resize(size);
  }
}

bool ConjugateGradients::step(std::vector<double>& x, const Function& function, ThreadTeam& team) {
  if (!is_evaluated_) value_ = function(x, gradient_);
  is_evaluated_ = true;
  turn_search(team);
  if (descend(x, function, team)) return true;
  restarts_ = true;
  last_decrease_ = 0;
  return !is_steepest_;
}

void ConjugateGradients::exchange(StateArchive& archive) {
  archive.values(previous_);
  archive.values(search_);
  archive.value(last_decrease_);
  archive.value(restarts_);
  if (archive.reading()) function_changed();
}

void ConjugateGradients::turn_search(ThreadTeam& team) {
  const double last = restarts_ ? 0 : dot(previous_, previous_, team);
  const double beta =
      last > 0 ? std::max(0.0, (dot(gradient_, gradient_, team) - dot(gradient_, previous_, team)) / last) : 0;
  is_steepest_ = !(beta > 0);
  for (std::size_t i = 0; i < search_.size(); ++i) search_[i] = beta * search_[i] - gradient_[i];
  slope_ = dot(search_, gradient_, team);
  if (slope_ >= 0) {
    is_steepest_ = true;
    for (std::size_t i = 0; i < search_.size(); ++i) search_[i] = -gradient_[i];
    slope_ = -dot(gradient_, gradient_, team);
  }
  restarts_ = false;
  previous_ = gradient_;
}

void ConjugateGradients::try_step(const std::vector<double>& x, double length, const Function& function, Trial& trial,
                                  ThreadTeam& team) const {
  team.run(x.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) trial.x[i] = x[i] + length * search_[i];
  });
  trial.value = function(trial.x, trial.gradient);
}

/// Tries a step, then the one to where the parabola through it has its minimum, and takes the better.
bool ConjugateGradients::descend(std::vector<double>& x, const Function& function, ThreadTeam& team) {
  if (!(slope_ < 0)) return false;
  double length = last_decrease_ > 0 ? 2 * last_decrease_ / -slope_ : first_length();
  for (int trial = 0; trial < kMostTrials; ++trial) {
    try_step(x, length, function, first_, team);
    const double excess = first_.value - value_ - slope_ * length;
    const double best = excess > 0 ? -slope_ * length * length / (2 * excess) : 4 * length;
    if (first_.value < value_) {
      try_step(x, std::min(best, 4 * length), function, second_, team);
      Trial& taken = second_.value < first_.value ? second_ : first_;
      last_decrease_ = value_ - taken.value;
      value_ = taken.value;
      x.swap(taken.x);
      gradient_.swap(taken.gradient);
      return true;
    }
    length = std::clamp(best, 0.1 * length, 0.5 * length);
  }
  return false;
}

/// Moves no point by more than a tenth of the unit of length.
double ConjugateGradients::first_length() const {
  const std::size_t count = search_.size() / 3;
  double most = 0;
  for (std::size_t i = 0; i < count; ++i) {
    most = std::max(most, std::hypot(search_[i], search_[count + i], search_[2 * count + i]));
  }
  return 0.1 / most;
}

}  // namespace crease
