#pragma once

#include <cstddef>

/// The number of heap allocations so far, in a test or benchmark one of whose sources includes
/// heap_counter.h. Where they can't be counted (sanitizers have a malloc of their own)
/// TETHER_COUNTS_ALLOCATIONS is not defined.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define TETHER_COUNTS_ALLOCATIONS 1
#endif

namespace tether {
inline long heap_allocations = 0;
inline size_t heap_bytes = 0;
}  // namespace tether
