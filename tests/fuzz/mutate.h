#pragma once

#include <string>
#include <vector>

#include "tether/common/random.h"

namespace tether::fuzz {

/// Inputs grow to this at most, bytes.
inline constexpr size_t kMostBytes = 1 << 16;

/// The input, changed in one to a few places: numbers by awkward ones, words by other words of the corpus,
/// lines and lists removed, moved, repeated, brackets nested, bytes flipped. The same random state gives the
/// same text. `corpus` must not be empty.
std::string Mutate(const std::string& input, const std::vector<std::string>& corpus, Random& random);

}  // namespace tether::fuzz
