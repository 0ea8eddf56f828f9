#include "core/base/quantile.h"

#include <gmock/gmock.h>

#include <random>

namespace crease {
namespace {

using testing::ElementsAre;

TEST(Quantiles, OfTheFirstNumbersAreTheirShares) {
  std::vector<int> numbers(101);
  for (int i = 0; i <= 100; ++i) numbers[static_cast<std::size_t>(i)] = i;
  std::mt19937 random(1);
  std::ranges::shuffle(numbers, random);
  EXPECT_THAT(quantiles(numbers, std::array{0.0, 0.1, 0.1, 0.5, 0.97, 1.0}), ElementsAre(0, 10, 10, 50, 97, 100));
}

TEST(Quantiles, EachIsWhatItIsAlone) {
  std::mt19937 random(2);
  std::vector<float> numbers(999);
  for (float& number : numbers) number = static_cast<float>(random() % 50);  // many alike
  constexpr std::array kShares{0.01, 0.25, 1.0 / 3, 0.5, 0.9};
  const auto together = quantiles(numbers, kShares);
  for (std::size_t k = 0; k < kShares.size(); ++k) EXPECT_EQ(together[k], quantile(numbers, kShares[k])) << k;
}

TEST(Quantiles, OfNothingAreZero) {
  EXPECT_EQ(quantile(std::vector<double>(), 0.5), 0);
  EXPECT_THAT(quantiles(std::vector<double>(), std::array{0.1, 0.9}), ElementsAre(0, 0));
}

TEST(Quantiles, OfOneNumberAreThatNumber) {
  EXPECT_THAT(quantiles(std::vector{7.5}, std::array{0.0, 0.5, 1.0}), ElementsAre(7.5, 7.5, 7.5));
}

}  // namespace
}  // namespace crease
