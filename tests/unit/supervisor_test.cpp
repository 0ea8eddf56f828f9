#include "server/worker/supervisor.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <set>

#include "core/error.h"
#include "server/base/failure.h"
#include "server/worker/child_process.h"
#include "tests/support/meshes.h"
#include "tests/support/server_process.h"
#include "tests/support/store_support.h"

namespace creased {
namespace code = crease::code;
namespace {

namespace fs = std::filesystem;
using crease::test::eventually;
using crease::test::fork_process;
using crease::test::is_alive;
using crease::test::read_file;
using crease::test::wait_for_process;
using testing::HasSubstr;

const Supervisor::Options kSleepers{.executable = "/bin/sleep", .arguments = {"1000"}, .processes = 3};

Supervisor::Options shell(const std::string& script) {
  return {.executable = "/bin/sh", .arguments = {"-c", script}, .processes = 1};
}

std::set<int> open_descriptors(int process) {
  std::set<int> numbers;
  for (const auto& entry : fs::directory_iterator("/proc/" + std::to_string(process) + "/fd")) {
    numbers.insert(std::stoi(entry.path().filename()));
  }
  return numbers;
}

TEST(SupervisorTest, AKilledWorkerIsReplaced) {
  Supervisor supervisor(kSleepers);
  const auto before = supervisor.process_ids();
  ASSERT_EQ(before.size(), 3U);
  ::kill(before[1], SIGKILL);
  EXPECT_TRUE(eventually([&] {
    const auto now = supervisor.process_ids();
    return now.size() == 3 && std::ranges::find(now, before[1]) == now.end();
  }));
  const auto after = supervisor.process_ids();
  EXPECT_EQ(after[0], before[0]);
  EXPECT_EQ(after[2], before[2]);
  supervisor.stop(crease::test::kPatience.count());
  for (const int process : after) EXPECT_FALSE(is_alive(process));
  EXPECT_TRUE(supervisor.process_ids().empty());
}

TEST(SupervisorTest, StopTerminatesBeforeItKills) {
  const crease::test::TemporaryFolder folder;
  const fs::path ready = folder.path() / "ready", asked = folder.path() / "asked";
  Supervisor supervisor(shell("trap 'echo asked > " + asked.string() + "; exit 0' TERM; echo > " + ready.string() +
                              "; while :; do sleep 0.01; done"));
  ASSERT_TRUE(eventually([&] { return fs::exists(ready); }));
  supervisor.stop(crease::test::kPatience.count());
  EXPECT_EQ(read_file(asked), "asked\n");
}

TEST(SupervisorTest, StopKillsWorkersThatIgnoreIt) {
  const crease::test::TemporaryFolder folder;
  const fs::path ready = folder.path() / "ready";
  Supervisor supervisor(shell("trap '' TERM; echo > " + ready.string() + "; while :; do sleep 0.01; done"));
  ASSERT_TRUE(eventually([&] { return fs::exists(ready); }));
  const int process = supervisor.process_ids().front();
  supervisor.stop(0.05);
  EXPECT_FALSE(is_alive(process));
}

TEST(SupervisorTest, WorkersThatDieAtOnceAreRestartedEverMoreSlowly) {
  const crease::test::TemporaryFolder folder;
  const fs::path log = folder.path() / "log";
  const auto start = std::chrono::steady_clock::now();
  Supervisor supervisor(shell("echo >> " + log.string()));
  ASSERT_TRUE(eventually([&] { return fs::exists(log) && fs::file_size(log) >= 4; }));
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(100 + 200 + 400));
}

TEST(SupervisorTest, WorkersDieWithAKilledParent) {
  ASSERT_EQ(::prctl(PR_SET_CHILD_SUBREAPER, 1), 0);  // so that orphans become children of this process
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  const pid_t parent = fork_process([&] {
    const Supervisor supervisor(kSleepers);
    const auto ids = supervisor.process_ids();
    const std::size_t bytes = ids.size() * sizeof(int);
    if (::write(ends[1], ids.data(), bytes) != static_cast<ssize_t>(bytes)) return 1;
    ::pause();
    return 0;
  });
  std::array<int, 3> workers{};
  ASSERT_EQ(::read(ends[0], workers.data(), sizeof workers), static_cast<ssize_t>(sizeof workers));
  for (const int worker : workers) EXPECT_TRUE(is_alive(worker));
  ::kill(parent, SIGKILL);
  wait_for_process(parent);
  for (const int worker : workers) {
    const int status = wait_for_process(worker);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL);
  }
  for (const int end : ends) ::close(end);
  ::prctl(PR_SET_CHILD_SUBREAPER, 0);
}

TEST(SupervisorTest, AMissingProgramIsAnError) {
  try {
    const Supervisor supervisor({.executable = "/no/such/program", .arguments = {}, .processes = 2});
    FAIL() << "no error";
  } catch (const crease::Error& error) {
    EXPECT_EQ(error.code(), code::kInternal);
    EXPECT_THAT(error.detail(), HasSubstr("/no/such/program: No such file or directory"));
  }
}

TEST(ChildProcessTest, AChildInheritsNoDescriptorAndHasDefaultSignals) {
  const Descriptor inheritable(::open("/dev/null", O_RDONLY));
  sigset_t blocked, former;
  ::sigemptyset(&blocked);
  ::sigaddset(&blocked, SIGTERM);
  ::pthread_sigmask(SIG_BLOCK, &blocked, &former);
  ChildProcess child({.executable = "/bin/sleep", .arguments = {"1000"}});
  ::pthread_sigmask(SIG_SETMASK, &former, nullptr);
  const std::set<int> standard{0, 1, 2};
  EXPECT_TRUE(eventually([&] { return open_descriptors(child.id()) == standard; })) << "after it has started";
  EXPECT_NE(::getpgid(child.id()), ::getpgid(0));
  EXPECT_FALSE(child.ended());
  child.signal(SIGTERM);
  EXPECT_EQ(child.wait(), "was killed by signal 15 (SIGTERM)");
}

TEST(ChildProcessTest, AChildReportsHowItEnded) {
  ChildProcess child({.executable = "/bin/sh", .arguments = {"-c", "exit 3"}});
  EXPECT_TRUE(child.wait_for(crease::test::kPatience));
  EXPECT_EQ(child.wait(), "ended with code 3");
  ChildProcess sleeper({.executable = "/bin/sleep", .arguments = {"1000"}});
  EXPECT_FALSE(sleeper.wait_for(std::chrono::milliseconds(5)));
}

TEST(ChildProcessTest, AChildDiesWithItsObject) {
  int process = 0;
  {
    const ChildProcess child({.executable = "/bin/sleep", .arguments = {"1000"}});
    process = child.id();
    EXPECT_TRUE(is_alive(process));
  }
  EXPECT_FALSE(is_alive(process));
}

}  // namespace
}  // namespace creased
