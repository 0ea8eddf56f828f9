#include "server/base/pace.h"

#include <gtest/gtest.h>

#include <chrono>

namespace creased {
namespace {

using namespace std::chrono_literals;

TEST(Pace, WhatIsDoneAsSoonAsItIsDueTakesItsPartOfTheTime) {
  constexpr int kParts = 10, kTimes = 50;
  Pace pace(kParts);
  const Pace::Clock::time_point begin;
  auto now = begin;
  Pace::Clock::duration busy{};
  EXPECT_TRUE(pace.due(now));
  for (int time = 1; time <= kTimes; ++time) {
    const auto took = time % 7 * 3ms;
    pace.note(now, now + took);
    busy += took;
    now += kParts * took;
    EXPECT_TRUE(pace.due(now));
    EXPECT_FALSE(pace.due(now - 1ns));
  }
  EXPECT_EQ(now - begin, kParts * busy);
}

TEST(Pace, WhatTakesNoTimeComesNoSoonerThanTheLeastPause) {
  Pace pace(10, 50ms);
  const Pace::Clock::time_point begin;
  pace.note(begin, begin + 1ms);
  EXPECT_FALSE(pace.due(begin + 49ms));
  EXPECT_TRUE(pace.due(begin + 50ms));
  pace.note(begin, begin + 6ms);
  EXPECT_FALSE(pace.due(begin + 59ms));
  EXPECT_TRUE(pace.due(begin + 60ms));
}

}  // namespace
}  // namespace creased
