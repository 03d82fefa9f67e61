#pragma once

#include <string>
#include <vector>

#include "tether/common/random.h"

namespace tether::task {

/// A random formula over these propositions, LTLf; of so many `leaves` + 9 draws, `leaves` end in a
/// proposition.
inline std::string RandomFormula(const std::vector<std::string>& propositions, int leaves, Random& random,
                                 int depth) {
  const auto sub = [&] { return RandomFormula(propositions, leaves, random, depth - 1); };
  switch (depth == 0 ? 9 : random.Index(9 + leaves)) {
    case 0:
      return "(" + sub() + " & " + sub() + ")";
    case 1:
      return "(" + sub() + " | " + sub() + ")";
    case 2:
      return "F(" + sub() + ")";
    case 3:
      return "G(" + sub() + ")";
    case 4:
      return "X[!](" + sub() + ")";
    case 5:
      return "(" + sub() + " U " + sub() + ")";
    case 6:
      return "(" + sub() + " R " + sub() + ")";
    case 7:
      return "F(" + sub() + " & X[!] F " + sub() + ")";
    case 8:
      return "!(" + sub() + ")";
    default:
      return propositions[static_cast<size_t>(random.Index(static_cast<int>(propositions.size())))];
  }
}

}  // namespace tether::task
