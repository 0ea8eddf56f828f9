#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "core/base/sanitized.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace crease::test {
namespace {

using testing::HasSubstr;
using testing::Not;

/// `creased serve` behind a command that sets limits; it must end by itself.
Finished start_within(std::vector<std::string> limits) {
  const PublicFolder folder;
  const std::string data_dir = (folder.path() / "data").string();
  limits.insert(limits.end(), {CREASED_BIN, "serve", "--port", "0", "--data-dir", data_dir, "--workers", "1"});
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
  const std::string user = "64123";  // has no processes
  std::vector<std::string> as_user = {"/usr/bin/setpriv", "--reuid", user, "--regid", user, "--clear-groups"};
  std::vector<std::string> probe = as_user;
  probe.insert(probe.end(), {CREASED_BIN, "--version"});
  if (run_program(probe).exit_code != 0) GTEST_SKIP() << "other users cannot reach the program";
  as_user.insert(as_user.end(), {"/usr/bin/prlimit", "--nproc=200"});
  expect_refusal(start_within(as_user), "threads", "ulimit -u");
}

TEST(Start, WithoutEnoughMemoryTheServerSaysSoAndEnds) {
  if (kSanitized) GTEST_SKIP() << "sanitizers reserve more address space than any limit";
  // Enough to begin with, but not for the stacks of 1,500 threads.
  expect_refusal(start_within({"/usr/bin/prlimit", "--as=2000000000"}), "", "ulimit -v");
}

TEST(Start, WithALimitOnFilesTheServerSaysSoAndEnds) {
  // Enough for the log, but not for the database. Without care, the signal of the limit would end the process unheard.
  expect_refusal(start_within({"/usr/bin/prlimit", "--fsize=12288"}), "cannot start", "database");
}

}  // namespace
}  // namespace crease::test
