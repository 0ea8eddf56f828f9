#include "server/base/cgroup.h"

#include <gtest/gtest.h>

#include <fstream>

#include "server/config.h"
#include "tests/support/temporary_folder.h"

namespace creased {
namespace {

namespace fs = std::filesystem;

class CgroupTest : public testing::Test {
 protected:
  void write(const std::string& path, const std::string& text) const {
    fs::create_directories((folder_.path() / path).parent_path());
    std::ofstream(folder_.path() / path) << text;
  }
  Allowance of(const std::string& groups) const { return allowance_of(folder_.path(), groups); }

  const crease::test::TemporaryFolder folder_;
};

constexpr std::uint64_t kGiB = 1U << 30U;

TEST_F(CgroupTest, WithoutLimitsTheMachineIsUsed) {
  write("cpu.max", "max 100000\n");
  write("memory.max", "max\n");
  write("memory/memory.limit_in_bytes", "9223372036854771712\n");
  write("cpu,cpuacct/cpu.cfs_quota_us", "-1\n");
  write("cpu,cpuacct/cpu.cfs_period_us", "100000\n");
  for (const char* groups : {"0::/\n", "", "garbage\n", "4:memory:/\n3:cpu,cpuacct:/\n0::/\n"}) {
    const Allowance found = of(groups);
    EXPECT_FALSE(found.processors) << groups;
    EXPECT_FALSE(found.memory_bytes) << groups;
  }
  EXPECT_EQ(usable_processors({}, 64), 64U);
  EXPECT_EQ(memory_per_job_mb({}, 32, 8'192), 8'192U);
}

TEST_F(CgroupTest, Version2TakesTheStrictestOfAllGroupsAbove) {
  write("a/cpu.max", "200000 100000\n");
  write("a/memory.max", "4294967296\n");
  write("a/b/cpu.max", "max 100000\n");
  write("a/b/memory.max", "8589934592\n");
  const Allowance found = of("0::/a/b\n");
  EXPECT_DOUBLE_EQ(found.processors.value(), 2);
  EXPECT_EQ(found.memory_bytes.value(), 4 * kGiB);
}

TEST_F(CgroupTest, InsideAContainerTheGroupIsAtTheRoot) {
  write("cpu.max", "150000 100000\n");
  write("memory.max", "1073741824\n");
  const Allowance found = of("0::/../../system.slice/docker-abc.scope\n");
  EXPECT_DOUBLE_EQ(found.processors.value(), 1.5);
  EXPECT_EQ(found.memory_bytes.value(), kGiB);
}

TEST_F(CgroupTest, Version1HasAMountForEachController) {
  write("cpu,cpuacct/docker/abc/cpu.cfs_quota_us", "50000\n");
  write("cpu,cpuacct/docker/abc/cpu.cfs_period_us", "100000\n");
  write("memory/docker/abc/memory.limit_in_bytes", "2147483648\n");
  const Allowance found = of("5:cpu,cpuacct:/docker/abc\n4:memory:/docker/abc\n1:name=systemd:/docker/abc\n");
  EXPECT_DOUBLE_EQ(found.processors.value(), 0.5);
  EXPECT_EQ(found.memory_bytes.value(), 2 * kGiB);
}

TEST_F(CgroupTest, ProcessorsAndMemoryFollowTheAllowance) {
  EXPECT_EQ(usable_processors({.processors = 2, .memory_bytes = {}}, 64), 2U);
  EXPECT_EQ(usable_processors({.processors = 1.5, .memory_bytes = {}}, 64), 2U);
  EXPECT_EQ(usable_processors({.processors = 0.2, .memory_bytes = {}}, 64), 1U);
  EXPECT_EQ(usable_processors({.processors = 16, .memory_bytes = {}}, 4), 4U);
  const auto of_memory = [](std::uint64_t bytes, std::size_t processes) {
    return memory_per_job_mb({.processors = {}, .memory_bytes = bytes}, processes, 8'192);
  };
  EXPECT_EQ(of_memory(4 * kGiB, 1), 4'096U - 512);
  EXPECT_EQ(of_memory(4 * kGiB, 2), (4'096U - 512) / 2);
  EXPECT_EQ(of_memory(64 * kGiB, 1), 8'192U) << "never more than without a limit";
  EXPECT_EQ(affordable_processes({.processors = {}, .memory_bytes = 4 * kGiB}, 32, 512), 7U);
  EXPECT_EQ(affordable_processes({.processors = {}, .memory_bytes = kGiB / 4}, 32, 512), 1U);
  EXPECT_EQ(affordable_processes({}, 32, 512), 32U);
  EXPECT_EQ(affordable_processes({}, 0, 512), 1U);
  for (const std::uint64_t bytes : {kGiB / 8, kGiB, 3 * kGiB, 16 * kGiB}) {
    for (const std::size_t processes : {1U, 2U, 4U}) {
      const std::size_t each = of_memory(bytes, processes);
      EXPECT_TRUE(each == 64 || each * processes <= bytes >> 20U) << bytes << " for " << processes;
    }
  }
}

TEST_F(CgroupTest, AWorkerOfItsOwnHasOneJobInItsMemory) {
  WorkerConfig worker;
  use_allowance(worker, {.processors = {}, .memory_bytes = 4 * kGiB});
  EXPECT_EQ(worker.job.memory_mb, 4'096U - 512);
  ServeConfig server;
  use_allowance(server, {.processors = 2, .memory_bytes = 4 * kGiB});
  EXPECT_EQ(server.job.memory_mb, worker.job.memory_mb) << "so that it accepts what the worker can run";
  WorkerConfig alone;
  use_allowance(alone, {});
  EXPECT_EQ(alone.job.memory_mb, JobConfig{}.memory_mb);
}

}  // namespace
}  // namespace creased
