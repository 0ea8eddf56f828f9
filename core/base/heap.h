#pragma once

#include <cstddef>

namespace crease {

/// Reserves `bytes` of address space for the heap, in huge pages where the kernel gives them, and keeps what is freed
/// there for later. No memory is taken before it is used; beyond `bytes` the heap grows as usual. Where so much address
/// space is not to be had, nothing is reserved.
///
/// For a process that does one job and ends, before it has other threads. A large mesh is read here and there: with
/// small pages most accesses miss the TLB, and each array that comes and goes costs a page fault for every page.
void reserve_heap(std::size_t bytes);

/// The address space that this process has taken, in bytes.
std::size_t address_space();

/// Half of the memory of this machine, in bytes: what a job alone on it may reserve.
std::size_t half_of_memory();

}  // namespace crease
