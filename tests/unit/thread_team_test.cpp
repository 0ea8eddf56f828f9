#include "core/base/thread_team.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <system_error>

#include "core/base/heap.h"
#include "core/base/sanitized.h"

namespace crease {
namespace {

/// Leaves room for the stacks of two or three threads. Ends with 0 if a team of many is refused, and is ended by a
/// signal if that takes for ever.
[[noreturn]] void ask_for_more_threads_than_there_are() {
  constexpr unsigned kLongestWait = 60;
  constexpr rlim_t kRoom = 30U << 20U, kStack = 8U << 20U;
  const rlimit stack{kStack, RLIM_INFINITY}, room{address_space() + kRoom, RLIM_INFINITY};
  ::setrlimit(RLIMIT_STACK, &stack);
  ::setrlimit(RLIMIT_AS, &room);
  ::alarm(kLongestWait);
  try {
    const ThreadTeam team(64);
  } catch (const std::system_error&) {
    std::_Exit(0);
  }
  std::_Exit(1);
}

/// It once waited for the threads that it had got.
TEST(ThreadTeamDeathTest, WithFewerThreadsThanItNeedsIsRefused) {
  if (kSanitized) GTEST_SKIP() << "sanitizers need the address space";
  EXPECT_EXIT(ask_for_more_threads_than_there_are(), testing::ExitedWithCode(0), "");
}

TEST(ThreadTeam, HasNoMoreThreadsThanAMeshIsWorth) {
  EXPECT_EQ(ThreadTeam(8, 0).size(), 1);
  EXPECT_EQ(ThreadTeam(8, 2 * kSitesPerThread - 1).size(), 1);
  EXPECT_EQ(ThreadTeam(8, 2 * kSitesPerThread).size(), 2);
  EXPECT_EQ(ThreadTeam(2, 100 * kSitesPerThread).size(), 2);
}

}  // namespace
}  // namespace crease
