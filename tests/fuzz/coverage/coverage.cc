#include "coverage.h"

#include <cstring>

namespace {

uint8_t edges[tether::fuzz::kCoverageSize];
thread_local uintptr_t previous = 0;

}  // namespace

/// Called at every basic block of instrumented code, and compiled without instrumentation itself.
extern "C" void __sanitizer_cov_trace_pc() {
  const uintptr_t here = reinterpret_cast<uintptr_t>(__builtin_return_address(0)) >> 2;
  edges[(here ^ previous) % tether::fuzz::kCoverageSize] = 1;
  previous = here >> 1;
}

namespace tether::fuzz {

void ClearCoverage() { std::memset(edges, 0, sizeof edges); }

size_t AddCoverage(uint8_t* seen) {
  size_t fresh = 0;
  for (size_t i = 0; i < kCoverageSize; ++i) {
    if (edges[i] == 0 || seen[i] != 0) continue;
    seen[i] = 1;
    ++fresh;
  }
  return fresh;
}

}  // namespace tether::fuzz
