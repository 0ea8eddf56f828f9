#include "core/base/heap.h"

#include <malloc.h>
#include <sys/mman.h>
#include <sys/sysinfo.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <memory>

#include "core/base/sanitized.h"

namespace crease {
namespace {

void set_allocator(int option, int value) {
  ::mallopt(option, value);  // NOLINT(concurrency-mt-unsafe): before there are other threads
}

}  // namespace

void reserve_heap(std::size_t bytes) {
  constexpr std::size_t kHugePage = 2U << 20U;
  constexpr int kNever = -1;
  if (kSanitized || bytes < 2 * kHugePage) return;
  // One block at the end of the one heap of all threads, which stays there when it is freed.
  set_allocator(M_ARENA_MAX, 1);
  set_allocator(M_MMAP_MAX, 0);
  set_allocator(M_TRIM_THRESHOLD, kNever);
  void* const block = std::malloc(bytes);
  if (block == nullptr) return;
  void* first = block;
  std::align(kHugePage, kHugePage, first, bytes);
  ::madvise(first, bytes / kHugePage * kHugePage, MADV_HUGEPAGE);
  std::free(block);
}

std::size_t address_space() {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

std::size_t half_of_memory() {
  struct sysinfo machine {};
  if (::sysinfo(&machine) != 0) return 0;
  return static_cast<std::size_t>(machine.totalram) * machine.mem_unit / 2;
}

}  // namespace crease
