#include "server/worker/sandbox.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <fstream>
#include <thread>

#include "core/base/sanitized.h"
#include "proto/parameter_table.h"
#include "server/base/failure.h"
#include "server/worker/channel.h"
#include "server/worker/confinement.h"
#include "tests/support/meshes.h"
#include "tests/support/server_process.h"
#include "tests/support/store_support.h"

namespace creased {
namespace code = crease::code;
namespace {

namespace fs = std::filesystem;
namespace v1 = crease::v1;
using crease::test::children_of;
using crease::test::eventually;
using crease::test::fork_process;
using crease::test::obj_text;
using crease::test::wait_for_process;

constexpr std::uint64_t kMiB = 1U << 20U;

v1::ComputeLimits limits(std::uint64_t memory_bytes = 0, std::uint64_t cpu_seconds = 0, std::uint64_t file_bytes = 0) {
  v1::ComputeLimits all;
  all.set_memory_bytes(memory_bytes);
  all.set_cpu_seconds(cpu_seconds);
  all.set_file_bytes(file_bytes);
  return all;
}

/// Runs `work` in a confined process, whose exit code is what it returns. Returns the wait status.
int confined(const v1::ComputeLimits& under, const std::function<int()>& work) {
  const Confinement confinement;
  return wait_for_process(fork_process([&] {
    confinement.enter(under);
    return work();
  }));
}

bool killed(int status, int signal) { return WIFSIGNALED(status) && WTERMSIG(status) == signal; }
bool succeeded(int status) { return WIFEXITED(status) && WEXITSTATUS(status) == 0; }

class ConfinementTest : public testing::Test {
 protected:
  void SetUp() override {
    if (crease::kSanitized) GTEST_SKIP() << "sanitizers need what the filter forbids";
  }
};

TEST_F(ConfinementTest, KillsAProcessThatRunsAProgramConnectsOrInspectsOthers) {
  EXPECT_TRUE(killed(confined(limits(), [] { return ::execl("/bin/true", "true", nullptr); }), SIGSYS));
  EXPECT_TRUE(killed(confined(limits(), [] { return ::socket(AF_INET, SOCK_STREAM, 0); }), SIGSYS));
  EXPECT_TRUE(killed(confined(limits(), [] { return ::socket(AF_UNIX, SOCK_DGRAM, 0); }), SIGSYS));
  EXPECT_TRUE(killed(confined(limits(), [] { return static_cast<int>(::ptrace(PTRACE_TRACEME, 0, 0, 0)); }), SIGSYS));
  EXPECT_TRUE(killed(confined(limits(), [] { return ::kill(::getppid(), SIGTERM); }), SIGSYS));
  EXPECT_TRUE(killed(confined(limits(), [] { return ::unshare(CLONE_NEWUSER); }), SIGSYS));
}

TEST_F(ConfinementTest, ForbidsOpeningFilesAndStartingProcesses) {
  const auto refused = [](const std::function<long()>& call) {
    return succeeded(confined(limits(), [&] {
      errno = 0;
      return call() < 0 && (errno == EPERM || errno == ENOSYS) ? 0 : 1;
    }));
  };
  EXPECT_TRUE(refused([] { return ::open("/etc/passwd", O_RDONLY); }));
  EXPECT_TRUE(refused([] { return ::open("/tmp", O_TMPFILE | O_WRONLY, 0600); }));
  EXPECT_TRUE(refused([] { return ::openat(AT_FDCWD, ".", O_RDONLY | O_DIRECTORY); }));
  EXPECT_TRUE(refused([] { return ::unlink("/tmp/anything"); }));
  EXPECT_TRUE(refused([] { return ::rename("/tmp/a", "/tmp/b"); }));
  EXPECT_TRUE(refused([] { return ::mkdir("/tmp/folder", 0700); }));
  EXPECT_TRUE(refused([] { return ::fork(); }));
  EXPECT_TRUE(refused([] { return ::syscall(SYS_clone3, nullptr, 0); }));
  struct stat status {};
  EXPECT_TRUE(refused([&] { return ::stat("/etc/passwd", &status); }));
  const rlimit more{RLIM_INFINITY, RLIM_INFINITY};
  EXPECT_TRUE(refused([&] { return ::setrlimit(RLIMIT_CPU, &more); }));
}

TEST_F(ConfinementTest, AllowsThreadsAndWritingToOpenFiles) {
  const crease::test::TemporaryFolder folder;
  const Descriptor file(::open((folder.path() / "file").c_str(), O_CREAT | O_WRONLY, 0600));
  EXPECT_TRUE(succeeded(confined(limits(2048 * kMiB, 60, kMiB), [&] {
    std::atomic<std::size_t> sum{0};
    {
      std::vector<std::jthread> threads;
      for (int i = 0; i < 4; ++i) {
        threads.emplace_back([&] { sum += std::vector<char>(kMiB, 1).size(); });
      }
    }
    return sum == 4 * kMiB && ::write(file.get(), "well", 4) == 4 ? 0 : 1;
  })));
  EXPECT_EQ(crease::test::read_file(folder.path() / "file"), "well");
}

TEST_F(ConfinementTest, LimitsMemoryProcessorTimeAndFiles) {
  EXPECT_TRUE(succeeded(confined(limits(512 * kMiB), [] {
    try {
      return std::vector<char>(1024 * kMiB, 1).back();
    } catch (const std::bad_alloc&) {
      return '\0';
    }
  })));
  EXPECT_TRUE(killed(confined(limits(0, 1),
                              [] {
                                for (std::atomic<std::uint64_t> forever{0};; ++forever) {
                                }
                                return 0;
                              }),
                     SIGXCPU));
  const crease::test::TemporaryFolder folder;
  const Descriptor file(::open((folder.path() / "file").c_str(), O_CREAT | O_WRONLY, 0600));
  EXPECT_TRUE(succeeded(confined(limits(0, 0, 1000), [&] {
    const std::string bytes(2000, 'x');
    const bool first = ::write(file.get(), bytes.data(), bytes.size()) == 1000;
    return first && ::write(file.get(), bytes.data(), bytes.size()) < 0 && errno == EFBIG ? 0 : 1;
  })));
}

TEST_F(ConfinementTest, SignalsOnlyItself) {
  const pid_t parent = ::getpid();
  EXPECT_TRUE(succeeded(confined(limits(), [&] {
    const bool refused = ::syscall(SYS_tgkill, parent, parent, SIGABRT) < 0 && errno == EPERM;
    return refused && ::syscall(SYS_tgkill, ::getpid(), ::getpid(), SIGTERM) < 0 ? 0 : 1;
  })));
  EXPECT_TRUE(killed(confined(limits(),
                              [] {
                                std::abort();
                                return 0;
                              }),
                     SIGABRT));
}

TEST_F(ConfinementTest, LimitsThreads) {
  if (::geteuid() != 0) GTEST_SKIP() << "another user's threads count, too";
  v1::ComputeLimits few = limits();
  few.set_threads(ThreadBudget().now());
  if (few.threads() == 0) GTEST_SKIP() << "in a container, its own limit has to do";
  EXPECT_TRUE(succeeded(confined(few, [] {
    std::vector<std::thread> threads;
    std::atomic<bool> end{false};
    bool refused = false;
    for (int i = 0; i < 20'000 && !refused; ++i) {
      try {
        threads.emplace_back([&] { end.wait(false); });
      } catch (const std::system_error&) {
        refused = true;
      }
    }
    end = true;
    end.notify_all();
    for (std::thread& thread : threads) thread.join();
    return refused && threads.size() >= 64 ? 0 : 1;
  })));
}

/// Runs `work` in a process that sees only itself and its children, as in a container. Returns the wait status.
int contained(const std::function<int()>& work) {
  return wait_for_process(fork_process([&] {
    if (::unshare(CLONE_NEWPID | CLONE_NEWNS) != 0) return 1;
    const int status = wait_for_process(fork_process([&] {
      const bool mounted = ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
                           ::mount("proc", "/proc", "proc", 0, nullptr) == 0;
      return mounted ? work() : 1;
    }));
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
  }));
}

TEST_F(ConfinementTest, ThreadsOfOtherContainersDoNotCountAgainstATask) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can start what is like a container";
  constexpr int kOthers = 1000;  // more than a task is given
  std::array<int, 2> ready{}, end{};
  ASSERT_TRUE(::pipe(ready.data()) == 0 && ::pipe(end.data()) == 0);
  const pid_t other = fork_process([&] {
    if (::setuid(65'534) != 0) return 1;
    ::close(end[1]);
    char byte = 0;
    std::vector<std::jthread> threads;
    for (int i = 0; i < kOthers; ++i) threads.emplace_back([&] { (void)::read(end[0], &byte, 1); });
    return ::write(ready[1], "r", 1) == 1 ? 0 : 1;
  });
  char byte = 0;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  EXPECT_TRUE(succeeded(contained([] {
    v1::ComputeLimits few = limits();
    few.set_threads(ThreadBudget().now());
    const int status = confined(few, [] {
      std::jthread([] {}).join();
      return 0;
    });
    return succeeded(status) ? 0 : 1;
  })));
  for (const int pipe_end : {ready[0], ready[1], end[0], end[1]}) ::close(pipe_end);
  EXPECT_TRUE(succeeded(wait_for_process(other)));
}

class SandboxTest : public testing::Test {
 protected:
  Descriptor file(const std::string& bytes) const {
    const fs::path path = folder_.path() / "upload";
    std::ofstream(path, std::ios::binary) << bytes;
    return open_to_read(path);
  }
  static v1::ComputeTask inspection() {
    v1::ComputeTask task;
    task.mutable_inspect()->set_format("obj");
    task.mutable_limits()->set_max_faces(10'000'000);
    task.mutable_limits()->set_max_vertices(10'000'000);
    return task;
  }
  /// A job that takes minutes, to be started with `slow_upload`.
  static v1::ComputeTask endless(std::uint64_t cpu_seconds = 0) {
    v1::ComputeTask task;
    *task.mutable_limits() = limits(0, cpu_seconds);
    task.mutable_limits()->set_max_faces(10'000);
    task.mutable_limits()->set_max_vertices(10'000);
    v1::Parameters parameters;
    parameters.set_sweeps(100'000);
    *task.mutable_run()->mutable_job()->mutable_parameters() = crease::resolve(parameters);
    task.mutable_run()->mutable_job()->mutable_input()->set_format("obj");
    task.mutable_run()->set_progress_every_ms(1'000);
    task.mutable_run()->set_snapshot_every_ms(1'000'000);
    task.mutable_run()->set_checkpoint_every_ms(1'000'000);
    return task;
  }
  Descriptor slow_upload() const { return file(obj_text(crease::test::cube(16))); }
  /// All events of a task, up to its end.
  static std::vector<v1::ComputeEvent> events_of(Sandbox& sandbox) {
    std::vector<v1::ComputeEvent> events;
    while (!sandbox.ended()) {
      if (auto event = sandbox.next_event(std::chrono::steady_clock::now() + crease::test::kPatience)) {
        events.push_back(std::move(*event));
      }
    }
    return events;
  }
  static int process_of_task(const Sandbox& sandbox) {
    std::vector<int> children;
    EXPECT_TRUE(eventually([&] {
      children = children_of(sandbox.process_id());
      return !children.empty();
    }));
    return children.at(0);
  }
  const crease::test::TemporaryFolder folder_;
};

TEST_F(SandboxTest, RunsEachTaskInItsOwnProcess) {
  Sandbox sandbox(CREASED_BIN);
  for (int i = 1; i <= 5; ++i) {
    const Descriptor upload = file(obj_text(crease::test::cube(i)));
    const int number = upload.get();
    sandbox.start(inspection(), {&number, 1});
    const auto events = events_of(sandbox);
    ASSERT_EQ(events.size(), 1U);
    EXPECT_EQ(events[0].inspected().facts().faces(), static_cast<std::uint32_t>(12 * i * i));
    EXPECT_FALSE(sandbox.loss());
  }
  EXPECT_TRUE(sandbox.alive());
  EXPECT_TRUE(children_of(sandbox.process_id()).empty());
}

TEST_F(SandboxTest, AKilledTaskIsLostAndTheNextOneRuns) {
  Sandbox sandbox(CREASED_BIN);
  const Descriptor slow = slow_upload();
  const int slow_number = slow.get();
  sandbox.start(endless(), {&slow_number, 1});
  ::kill(process_of_task(sandbox), SIGKILL);
  for (const auto& event : events_of(sandbox)) EXPECT_TRUE(event.has_progress());
  const auto loss = sandbox.loss();
  ASSERT_TRUE(loss);
  EXPECT_EQ(loss->what, "was killed by signal 9 (SIGKILL)");
  EXPECT_EQ(loss->code, code::kWorkerLost);
  EXPECT_FALSE(loss->by_limit);

  const Descriptor upload = file(obj_text(crease::test::cube(1)));
  const int number = upload.get();
  sandbox.start(inspection(), {&number, 1});
  EXPECT_EQ(events_of(sandbox).size(), 1U);
}

TEST_F(SandboxTest, ATaskOverItsProcessorTimeIsLostByALimit) {
  Sandbox sandbox(CREASED_BIN);
  const Descriptor upload = slow_upload();
  const int number = upload.get();
  sandbox.start(endless(1), {&number, 1});
  events_of(sandbox);
  const auto loss = sandbox.loss();
  ASSERT_TRUE(loss);
  EXPECT_EQ(loss->what, "needed more than 1 s of processor time");
  EXPECT_EQ(loss->code, code::kTimeLimitExceeded);
  EXPECT_TRUE(loss->by_limit);
}

TEST_F(SandboxTest, StandardErrorIsAPipeAndTheEnvironmentIsEmpty) {
  if (crease::kSanitized) GTEST_SKIP() << "sanitizers have their options there";
  const Sandbox sandbox(CREASED_BIN);
  const std::string proc = "/proc/" + std::to_string(sandbox.process_id());
  EXPECT_THAT(fs::read_symlink(proc + "/fd/2").string(), testing::StartsWith("pipe:"));
  EXPECT_EQ(crease::test::read_file(proc + "/environ"), "");
}

TEST_F(SandboxTest, ATaskDiesWithTheProcessThatStartedIt) {
  Sandbox sandbox(CREASED_BIN);
  const Descriptor slow = slow_upload();
  const int number = slow.get();
  sandbox.start(endless(), {&number, 1});
  const int task = process_of_task(sandbox);
  sandbox.kill();
  EXPECT_TRUE(eventually([&] { return !crease::test::is_alive(task); }));
  EXPECT_FALSE(sandbox.alive());
  EXPECT_TRUE(sandbox.ended());
}

TEST(ChannelTest, MessagesKeepTheirBoundariesAndDescriptors) {
  auto [here, there] = make_channel();
  v1::RunOrder order;
  ASSERT_TRUE(send_message(here.get(), order)) << "an empty message is a message";
  order.set_file(v1::RUN_FILE_REPORT);
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  const Descriptor read_end(ends[0]);
  {
    const Descriptor write_end(ends[1]);
    const int number = write_end.get();
    ASSERT_TRUE(send_message(here.get(), order, {&number, 1}));
  }
  v1::RunOrder found;
  std::vector<Descriptor> files;
  EXPECT_EQ(receive_message(there.get(), found, std::nullopt, &files), Receipt::kMessage);
  EXPECT_TRUE(files.empty());
  EXPECT_EQ(receive_message(there.get(), found, std::nullopt, &files), Receipt::kMessage);
  EXPECT_EQ(found.file(), v1::RUN_FILE_REPORT);
  ASSERT_EQ(files.size(), 1U);
  EXPECT_EQ(::write(files[0].get(), "x", 1), 1);
  char byte = 0;
  EXPECT_EQ(::read(read_end.get(), &byte, 1), 1);
  EXPECT_EQ(receive_message(there.get(), found, std::chrono::steady_clock::now()), Receipt::kNothing);
  here.close();
  EXPECT_EQ(receive_message(there.get(), found), Receipt::kEnded);
  EXPECT_FALSE(send_message(there.get(), order));
}

TEST(ChannelTest, MessagesOfAPeerThatLeftWithUnreadInputAreRead) {
  auto [here, there] = make_channel();
  v1::RunOrder order;
  order.set_stop(true);
  ASSERT_TRUE(send_message(here.get(), order));
  ASSERT_TRUE(send_message(there.get(), order));
  here.close();
  v1::RunOrder found;
  EXPECT_EQ(receive_message(there.get(), found), Receipt::kMessage);
  EXPECT_TRUE(found.stop());
  EXPECT_EQ(receive_message(there.get(), found), Receipt::kEnded);
}

TEST(ChannelTest, InvalidMessagesEndTheChannel) {
  for (const std::string& bytes : {std::string(1, '\0') + "\xff\xff\xff", std::string(200'000, '\0')}) {
    auto [here, there] = make_channel();
    ASSERT_EQ(::send(here.get(), bytes.data(), bytes.size(), 0), static_cast<ssize_t>(bytes.size()));
    v1::RunOrder found;
    EXPECT_EQ(receive_message(there.get(), found), Receipt::kEnded);
  }
}

}  // namespace
}  // namespace creased
