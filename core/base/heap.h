#pragma once

#include <cstddef>

namespace crease {

/// Reserves `bytes` of address space for the heap, in huge pages where the kernel gives them, and keeps what is freed
/// there for later. No memory is taken before it is used; beyond `bytes` the heap grows as usual. Where so much address
/// space is not to be had, nothing is reserved.
///
/// For a process that does one job and ends, before it has other threads. The arrays of a large mesh are read and
/// written here and there, so that small pages cost a miss of the address cache at every step, and arrays that come and
/// go cost a fault for every page anew.
void reserve_heap(std::size_t bytes);

/// Half of the memory of this machine, in bytes: what a job alone on it may reserve.
std::size_t half_of_memory();

}  // namespace crease
