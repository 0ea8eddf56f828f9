#include "core/base/random.h"

#include <gtest/gtest.h>

#include <set>

namespace crease {
namespace {

using Words = CounterRandom::Words;

// The known answers for Philox-4x32-10 [Salmon et al. 2011].
TEST(CounterRandom, PhiloxGivesThePublishedAnswers) {
  EXPECT_EQ(CounterRandom::philox({0, 0, 0, 0}, {0, 0}), (Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  const std::uint32_t all = 0xffffffff;
  EXPECT_EQ(CounterRandom::philox({all, all, all, all}, {all, all}),
            (Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(CounterRandom::philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(CounterRandom, EverySiteSweepDrawStreamAndSeedHasItsOwnWords) {
  std::set<Words> seen;
  for (const std::uint32_t seed : {1U, 2U}) {
    for (const RandomStream stream : {RandomStream::kVertexProcess, RandomStream::kEdgeProcess, RandomStream::kNoise}) {
      const CounterRandom random(seed, stream);
      for (std::uint32_t sweep = 0; sweep < 10; ++sweep) {
        for (std::uint32_t site = 0; site < 10; ++site) {
          for (std::uint32_t draw = 0; draw < 2; ++draw) seen.insert(random(sweep, site, draw));
        }
      }
    }
  }
  EXPECT_EQ(seen.size(), 2U * 3U * 10U * 10U * 2U);
}

TEST(CounterRandom, ManySitesAtOnceGetTheSameWordsAsEachAlone) {
  const CounterRandom random(3, RandomStream::kVertexProcess);
  const std::array<std::uint32_t, 8> sites{0, 7, 1, 1000, 0xffffffff, 5, 5, 42};
  const auto words = random(17, sites);
  for (std::size_t k = 0; k < sites.size(); ++k) {
    EXPECT_EQ((Words{words[0][k], words[1][k], words[2][k], words[3][k]}), random(17, sites[k]));
  }
}

TEST(CounterRandom, UnitNumbersStayInTheirInterval) {
  EXPECT_GT(CounterRandom::unit(0), 0.0);
  EXPECT_LT(CounterRandom::unit(0xffffffff), 1.0);
  EXPECT_GT(CounterRandom::symmetric(0), -1.0);
  EXPECT_LT(CounterRandom::symmetric(0xffffffff), 1.0);
}

}  // namespace
}  // namespace crease
