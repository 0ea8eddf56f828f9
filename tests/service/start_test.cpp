#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "server/worker/sanitized.h"
#include "tests/support/program.h"

namespace crease::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

/// `creased serve` behind a command that sets limits; it must end by itself.
Finished start_within(std::vector<std::string> limits, const std::vector<std::string>& flags = {}) {
  const TemporaryFolder folder;
  fs::permissions(folder.path(), fs::perms::all);
  limits.insert(limits.end(), {CREASED_BIN, "serve", "--port", "0", "--data-dir", (folder.path() / "data").string(),
                               "--workers", "1"});
  limits.insert(limits.end(), flags.begin(), flags.end());
  return run_program(limits);
}

void expect_refusal(const Finished& run, const std::string& what, const std::string& remedy) {
  EXPECT_EQ(run.exit_code, 1) << run.errors;
  EXPECT_THAT(run.errors, HasSubstr(what));
  EXPECT_THAT(run.errors, HasSubstr(remedy));
  EXPECT_THAT(run.errors, Not(HasSubstr("listening")));
}

TEST(Start, WithoutEnoughThreadsTheServerSaysSoAndEnds) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root, to run as a user without other processes";
  constexpr const char* kUser = "64123";  // has no processes
  const auto run = start_within(
      {"/usr/bin/setpriv", "--reuid", kUser, "--regid", kUser, "--clear-groups", "/usr/bin/prlimit", "--nproc=200"});
  expect_refusal(run, "threads", "ulimit -u");
}

TEST(Start, WithoutEnoughMemoryTheServerSaysSoAndEnds) {
  if (creased::kSanitized) GTEST_SKIP() << "sanitizers reserve more address space than any limit";
  // Enough to begin with, but not for the stacks of 1,500 threads.
  expect_refusal(start_within({"/usr/bin/prlimit", "--as=2000000000"}), "", "ulimit -v");
}

}  // namespace
}  // namespace crease::test
