#include "core/base/heap.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "core/base/sanitized.h"

namespace crease {
namespace {

constexpr std::size_t kReserved = 256U << 20U, kLargeBlock = 64U << 20U;

/// The flags of the mapping that `address` lies in.
std::string flags_at(const void* address) {
  const auto place = reinterpret_cast<std::uintptr_t>(address);
  std::ifstream maps("/proc/self/smaps");
  bool inside = false;
  for (std::string line; std::getline(maps, line);) {
    std::uintptr_t first = 0, end = 0;
    char dash = 0;
    if (std::istringstream(line) >> std::hex >> first >> dash >> end && dash == '-') {
      inside = first <= place && place < end;
    }
    if (inside && line.starts_with("VmFlags:")) return line + " ";
  }
  return {};
}

std::size_t resident_bytes() {
  std::size_t total = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> total >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

/// Ends this process, as a death test expects: with 0 where `good`.
[[noreturn]] void end(bool good) { ::_exit(good ? 0 : 1); }

class HeapTest : public testing::Test {
 protected:
  void SetUp() override {
    if (kSanitized) GTEST_SKIP() << "sanitizers have a heap of their own";
  }
};

TEST_F(HeapTest, WhatIsReservedTakesNoMemoryAndServesLargeBlocks) {
  EXPECT_EXIT(
      {
        const std::size_t before = resident_bytes();
        reserve_heap(kReserved);
        const void* const end_of_heap = ::sbrk(0);
        void* const block = std::malloc(kLargeBlock);
        end(resident_bytes() < before + kLargeBlock / 4 && block < end_of_heap && ::sbrk(0) == end_of_heap);
      },
      testing::ExitedWithCode(0), "");
}

TEST_F(HeapTest, WhatIsFreedStays) {
  EXPECT_EXIT(
      {
        reserve_heap(kReserved);
        const void* const end_of_heap = ::sbrk(0);
        void* const block = std::malloc(kLargeBlock);
        std::free(block);
        end(::sbrk(0) == end_of_heap && std::malloc(kLargeBlock) == block);
      },
      testing::ExitedWithCode(0), "");
}

TEST_F(HeapTest, AsksForHugePages) {
  if (!std::filesystem::exists("/sys/kernel/mm/transparent_hugepage")) GTEST_SKIP() << "this kernel has none";
  EXPECT_EXIT(
      {
        reserve_heap(kReserved);
        const auto* const block = static_cast<const char*>(std::malloc(kLargeBlock));
        end(flags_at(block + kLargeBlock / 2).find(" hg ") != std::string::npos);
      },
      testing::ExitedWithCode(0), "");
}

TEST_F(HeapTest, ThereIsAHeapWhereTheAddressSpaceIsNotToBeHad) {
  EXPECT_EXIT(
      {
        reserve_heap(std::size_t{1} << 60U);
        end(std::malloc(kLargeBlock) != nullptr);
      },
      testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace crease
