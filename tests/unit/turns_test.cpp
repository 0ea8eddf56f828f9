#include "server/jobs/turns.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace creased {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;

constexpr milliseconds kLarge{500}, kSmall{1}, kHuge{5'000};

class TurnsTest : public testing::Test {
 protected:
  /// Enters work that comes `after_ms` after the start.
  Turns::Ticket enter(Turns& turns, const std::string& owner, milliseconds work, int after_ms = 0) const {
    return turns.enter(owner, work, start_ + milliseconds(after_ms));
  }
  /// All work in the order of its turns, each ending before the next.
  static std::vector<Turns::Ticket> one_by_one(Turns& turns) {
    std::vector<Turns::Ticket> order;
    while (const auto ticket = turns.next()) {
      order.push_back(*ticket);
      turns.leave(*ticket);
    }
    return order;
  }

  const Turns::Clock::time_point start_ = Turns::Clock::now();
};

TEST_F(TurnsTest, OwnersTakeTurnsHoweverManyEachHas) {
  Turns turns(1, kLarge);
  const auto a1 = enter(turns, "anna", kSmall), a2 = enter(turns, "anna", kSmall), a3 = enter(turns, "anna", kSmall),
             b1 = enter(turns, "bert", kSmall, 5), b2 = enter(turns, "bert", kSmall, 6),
             c1 = enter(turns, "carl", kSmall, 9);
  EXPECT_THAT(one_by_one(turns), ElementsAre(a1, b1, c1, a2, b2, a3));
}

TEST_F(TurnsTest, WhoHasFewerPlacesGoesFirst) {
  Turns turns(3, kLarge);
  const auto a1 = enter(turns, "anna", kSmall), a2 = enter(turns, "anna", kSmall);
  EXPECT_EQ(turns.next(), a1);
  const auto b1 = enter(turns, "bert", kSmall, 7), b2 = enter(turns, "bert", kSmall, 8);
  EXPECT_EQ(turns.next(), b1);
  EXPECT_EQ(turns.next(), a2) << "both have one, and anna was served longer ago";
  EXPECT_EQ(turns.next(), std::nullopt) << "all places are taken";
  turns.leave(a1);
  EXPECT_EQ(turns.next(), b2);
}

TEST_F(TurnsTest, SmallWorkPassesLargeWorkOfItsOwnerButNotForEver) {
  Turns turns(1, kLarge);
  const auto huge = enter(turns, "anna", kHuge), small = enter(turns, "anna", kSmall, 10),
             late = enter(turns, "anna", kSmall, 10'000);
  EXPECT_THAT(one_by_one(turns), ElementsAre(small, huge, late));
}

TEST_F(TurnsTest, LargeWorkLeavesAPlaceForSmallWork) {
  Turns turns(3, kLarge);
  const auto first = enter(turns, "anna", kHuge), second = enter(turns, "bert", kHuge),
             third = enter(turns, "carl", kHuge);
  EXPECT_EQ(turns.next(), first);
  EXPECT_EQ(turns.next(), second);
  EXPECT_EQ(turns.next(), std::nullopt) << "one place is for small work";
  const auto small = enter(turns, "anna", kSmall, 1);
  EXPECT_EQ(turns.next(), small);
  turns.leave(small);
  EXPECT_EQ(turns.next(), std::nullopt);
  turns.leave(first);
  EXPECT_EQ(turns.next(), third);
}

TEST_F(TurnsTest, ASinglePlaceIsForAll) {
  Turns turns(1, kLarge);
  const auto huge = enter(turns, "anna", kHuge);
  EXPECT_EQ(turns.next(), huge);
}

TEST_F(TurnsTest, WhoeverLeavesWhileWaitingIsPassedOver) {
  Turns turns(1, kLarge);
  const auto a = enter(turns, "anna", kSmall), b = enter(turns, "bert", kSmall, 1);
  turns.leave(a);
  turns.leave(a);
  EXPECT_EQ(turns.waiting(), 1U);
  EXPECT_EQ(turns.next(), b);
}

TEST_F(TurnsTest, ManyOwnersLeaveNothingBehindThatGrows) {
  Turns turns(2, kLarge);
  for (int i = 0; i < 20'000; ++i) {
    turns.leave(turns.enter(std::to_string(i), kSmall, start_));
    EXPECT_LE(turns.owners(), 1'001U);
  }
}

}  // namespace
}  // namespace creased
