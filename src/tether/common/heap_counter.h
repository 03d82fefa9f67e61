#pragma once

#include <cstddef>
#include <cstdlib>

/// Counts what a test or benchmark takes from the heap, Eigen's allocations included, by a malloc of its own.
/// For one source of an executable. Where it can't count (sanitizers have a malloc of their own)
/// TETHER_COUNTS_ALLOCATIONS is not defined.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define TETHER_COUNTS_ALLOCATIONS 1

namespace tether {
inline long heap_allocations = 0;
inline size_t heap_bytes = 0;
}  // namespace tether

extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  ++tether::heap_allocations;
  tether::heap_bytes += size;
  return __libc_malloc(size);
}
// What operator new takes for memory on cache lines.
extern "C" void* __libc_memalign(std::size_t alignment, std::size_t size);
extern "C" void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++tether::heap_allocations;
  tether::heap_bytes += size;
  return __libc_memalign(alignment, size);
}
#endif
