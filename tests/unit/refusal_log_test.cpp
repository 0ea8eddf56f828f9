#include "server/api/refusal_log.h"

#include <gtest/gtest.h>

namespace creased {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class RefusalLogTest : public testing::Test {
 protected:
  /// How many of `count` refusals at this time are logged one by one.
  std::uint64_t logged(const std::string& reason, int count, milliseconds at) {
    std::uint64_t lines = 0;
    for (int i = 0; i < count; ++i) lines += log_.admit(reason, start_ + at) ? 1U : 0U;
    return lines;
  }
  std::vector<RefusalLog::Summary> summaries(milliseconds at) { return log_.take_summaries(seconds(1), start_ + at); }

  const RefusalLog::Clock::time_point start_ = RefusalLog::Clock::now();
  RefusalLog log_;
};

TEST_F(RefusalLogTest, FewRefusalsAreLoggedAndAFloodIsCounted) {
  EXPECT_EQ(logged("rate_limited", 3, milliseconds(0)), 3U);
  EXPECT_TRUE(summaries(milliseconds(10)).empty());
  EXPECT_EQ(logged("rate_limited", 100'000, milliseconds(500)), RefusalLog::kOneByOne - 3);
  EXPECT_EQ(logged("unauthorized", 5, milliseconds(500)), 5U) << "each reason by itself";
  const auto found = summaries(milliseconds(1'500));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].reason, "rate_limited");
  EXPECT_EQ(found[0].count, 100'003 - RefusalLog::kOneByOne);
  EXPECT_DOUBLE_EQ(found[0].seconds, 1);
  EXPECT_TRUE(summaries(milliseconds(3'000)).empty()) << "each is counted once";
}

TEST_F(RefusalLogTest, ALongFloodTakesABoundedNumberOfLinesASecond) {
  std::uint64_t lines = 0, refused = 0, counted = 0;
  constexpr int kSeconds = 60;
  for (int ms = 0; ms < kSeconds * 1'000; ms += 100) {
    lines += logged("too_many_connections", 500, milliseconds(ms));
    refused += 500;
    for (const auto& summary : summaries(milliseconds(ms))) {
      ++lines;
      counted += summary.count;
    }
  }
  EXPECT_LE(lines, kSeconds * (RefusalLog::kOneByOne + 1) + RefusalLog::kOneByOne);
  for (const auto& summary : summaries(milliseconds(kSeconds * 1'000))) counted += summary.count;
  EXPECT_EQ(refused, counted + kSeconds * RefusalLog::kOneByOne);
}

}  // namespace
}  // namespace creased
