#pragma once

#include <cstddef>
#include <cstdint>

namespace tether::fuzz {

/// Which places of the program have run: one byte per hashed edge. The compiler calls the hook behind it in
/// builds with `-fsanitize-coverage=trace-pc` (the sanitizer preset); in others nothing is ever counted.
inline constexpr size_t kCoverageSize = 1 << 16;

/// Forgets what has run.
void ClearCoverage();
/// Adds what has run since ClearCoverage() to `seen`; returns how many of its entries are new.
size_t AddCoverage(uint8_t* seen);

}  // namespace tether::fuzz
