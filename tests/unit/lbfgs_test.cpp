#include "core/graduated/lbfgs.h"

#include <gtest/gtest.h>

#include <cmath>

namespace crease {
namespace {

/// Half of Σ w_i (x_i − c_i)², with weights from 1 to 100 and c_i from −1 to 1.
struct Bowl {
  explicit Bowl(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      weights.push_back(std::pow(10.0F, static_cast<float>(i % 7) / 3));
      centre.push_back(std::sin(static_cast<float>(i)));
    }
  }

  DifferentiableFunction function() const {
    return [this](std::span<const float> x, std::span<float> gradient) {
      double value = 0;
      for (std::size_t i = 0; i < x.size(); ++i) {
        const float away = x[i] - centre[i];
        gradient[i] = weights[i] * away;
        value += static_cast<double>(weights[i] * away * away) / 2;
      }
      return value;
    };
  }

  double value(const std::vector<float>& x) const {
    std::vector<float> gradient(x.size());
    return function()(x, gradient);
  }

  float farthest(const std::vector<float>& x) const {
    float most = 0;
    for (std::size_t i = 0; i < x.size(); ++i) most = std::max(most, std::abs(x[i] - centre[i]));
    return most;
  }

  std::vector<float> weights, centre;
};

constexpr std::size_t kNumbers = 3 * 10'001;  // not a multiple of any block

/// Where a search from zero ends.
std::vector<float> end_of(const Bowl& bowl, const LbfgsOptions& options, std::uint32_t threads = 2) {
  std::vector<float> x(kNumbers, 0);
  ThreadTeam team(threads);
  LbfgsMemory memory;
  minimize(bowl.function(), x, options, team, memory);
  return x;
}

TEST(Lbfgs, FindsTheCentreOfABowl) {
  const Bowl bowl(kNumbers);
  LbfgsOptions options;
  options.steps = 100;
  EXPECT_LT(bowl.farthest(end_of(bowl, options)), 1e-2F);
}

TEST(Lbfgs, TheSameBitsForAnyNumberOfThreads) {
  const Bowl bowl(kNumbers);
  LbfgsOptions options;
  options.steps = 12;
  const std::vector<float> alone = end_of(bowl, options, 1);
  for (const std::uint32_t threads : {2U, 5U}) EXPECT_EQ(end_of(bowl, options, threads), alone);
}

// The first step tells the factor, the second one ends in the centre.
TEST(Lbfgs, TwoStepsAreEnoughWithTheTrueCurvaturesUpToAFactor) {
  const Bowl bowl(kNumbers);
  std::vector<float> metric;
  for (const float weight : bowl.weights) metric.push_back(17 / weight);
  LbfgsOptions options;
  options.steps = 2;
  options.diagonal = &metric;
  EXPECT_LT(bowl.farthest(end_of(bowl, options)), 1e-4F);
}

TEST(Lbfgs, AMetricThatSolvesIsTakenAtItsWord) {
  const Bowl bowl(kNumbers);
  LbfgsOptions options;
  options.steps = 1;
  options.solve = [&](std::span<float> step) {
    for (std::size_t i = 0; i < step.size(); ++i) step[i] /= bowl.weights[i];
  };
  EXPECT_LT(bowl.farthest(end_of(bowl, options)), 1e-5F);
}

/// Where two short searches in a row end, the second of which forgets the last step of the first, or goes on from it as
/// the first left it or as it is handed on by `pass_on`.
template <typename PassOn>
std::vector<float> end_of_two(const Bowl& bowl, const LbfgsOptions& options, PassOn pass_on) {
  std::vector<float> x(kNumbers, 0);
  ThreadTeam team(2);
  LbfgsMemory memory;
  minimize(bowl.function(), x, options, team, memory);
  pass_on(memory);
  minimize(bowl.function(), x, options, team, memory);
  return x;
}

constexpr auto kAsItIs = [](LbfgsMemory&) {};

// It knows how long a step should be.
TEST(Lbfgs, TheFirstStepOfASearchThatGoesOnIsAheadOfOneThatBeginsAnew) {
  const Bowl bowl(kNumbers);
  LbfgsOptions options;
  options.steps = 1;
  const std::vector<float> anew = end_of_two(bowl, options, kAsItIs);
  options.goes_on = true;
  EXPECT_LT(bowl.value(end_of_two(bowl, options, kAsItIs)), bowl.value(anew) / 2);
}

TEST(Lbfgs, TheLastStepIsAllThatASearchTakesFromTheOneBefore) {
  const Bowl bowl(kNumbers);
  LbfgsOptions options;
  options.steps = 6;
  options.goes_on = true;
  const auto last_step_alone = [](LbfgsMemory& memory) {
    LbfgsMemory other;
    other.last = memory.last;
    memory = other;
  };
  EXPECT_EQ(end_of_two(bowl, options, last_step_alone), end_of_two(bowl, options, kAsItIs));
}

}  // namespace
}  // namespace crease
