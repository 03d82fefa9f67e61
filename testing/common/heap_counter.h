#pragma once

#include <cstdlib>

#include "testing/common/heap_count.h"

/// Counts the heap allocations of a test or benchmark, Eigen's included, by a malloc of its own. For one
/// source of an executable; the others read heap_count.h.
#ifdef TETHER_COUNTS_ALLOCATIONS

extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  ++tether::heap_allocations;
  tether::heap_bytes += size;
  return __libc_malloc(size);
}
// Used by operator new for memory on cache lines.
extern "C" void* __libc_memalign(std::size_t alignment, std::size_t size);
extern "C" void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++tether::heap_allocations;
  tether::heap_bytes += size;
  return __libc_memalign(alignment, size);
}
#endif
