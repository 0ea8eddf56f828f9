#include "tests/quality/error_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/choice/odds_model.h"

namespace crease::quality {
namespace {

struct TwoMethods : ErrorModel<2, 2, Kernel::kExponential> {
  static constexpr double kWorst = 5;
};
using TwoErrors = Sample<TwoMethods>;

TEST(ErrorFit, AModelGivesBackThePairsThatItWasFittedTo) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::vector<TwoErrors> samples(50);
  for (TwoErrors& sample : samples) {
    sample.features = {normal(random), 10 + normal(random)};
    sample.errors = {std::exp(normal(random)), std::exp(normal(random))};
  }
  const auto fit = fitted<TwoMethods>(pointers_to(samples));
  const auto known = samples_known_to<TwoErrors>(fit.model);
  ASSERT_EQ(known.size(), samples.size());
  for (std::size_t s = 0; s < samples.size(); ++s) {
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_NEAR(known[s].features[i], samples[s].features[i],
                  fit.model.deviations[i] / TwoMethods::kStepsPerDeviation);
      EXPECT_NEAR(std::log(known[s].errors[i]), loss(samples[s], i), 1e-9);
    }
  }
}

struct Drawn {
  std::array<double, 1> numbers{};
  bool is_so = false;
};

TEST(ErrorFit, LogisticRegressionFindsTheOddsThatSamplesWereDrawnWith) {
  const auto log_odds = [](double number) { return 1 + 2 * number - number * number; };
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Drawn> samples(20'000);
  for (Drawn& sample : samples) {
    sample.numbers[0] = normal(random);
    sample.is_so = unit(random) < 1 / (1 + std::exp(-log_odds(sample.numbers[0])));
  }
  OddsModel<1> model;
  standardise(pointers_to(samples), &Drawn::numbers, model);
  fit_odds(model, pointers_to(samples), &Drawn::numbers, [](const Drawn& sample) { return Verdict{sample.is_so}; });
  for (const double number : {-1.0, 0.0, 0.5, 1.5}) EXPECT_NEAR(model.log_odds({number}), log_odds(number), 0.15);
}

}  // namespace
}  // namespace crease::quality
