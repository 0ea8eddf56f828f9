#include "core/base/heap.h"

#include <malloc.h>
#include <sys/mman.h>
#include <sys/sysinfo.h>

#include <cstdint>
#include <cstdlib>

#include "core/base/sanitized.h"

namespace crease {

void reserve_heap(std::size_t bytes) {
  constexpr std::size_t kHugePage = 2U << 20U;
  constexpr int kNever = -1;
  if (kSanitized || bytes < 2 * kHugePage) return;
  // One block at the end of the one heap of all threads, which stays there when it is freed.
  ::mallopt(M_ARENA_MAX, 1);
  ::mallopt(M_MMAP_MAX, 0);
  ::mallopt(M_TRIM_THRESHOLD, kNever);
  void* block = std::malloc(bytes);
  if (block == nullptr) return;
  const auto first = (reinterpret_cast<std::uintptr_t>(block) + kHugePage - 1) & ~(kHugePage - 1);
  const std::size_t length = (bytes - kHugePage) & ~(kHugePage - 1);
  ::madvise(reinterpret_cast<void*>(first), length, MADV_HUGEPAGE);
  std::free(block);
}

std::size_t half_of_memory() {
  struct sysinfo machine {};
  if (::sysinfo(&machine) != 0) return 0;
  return static_cast<std::size_t>(machine.totalram) * machine.mem_unit / 2;
}

}  // namespace crease
