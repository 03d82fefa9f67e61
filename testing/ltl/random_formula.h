#pragma once

#include <string>

#include "tether/common/random.h"
#include "tether/ltl/formula/formula.h"

namespace tether::ltl::testing {

/// ∧ F(aᵢ & X[!] F bᵢ), i < n: n tasks of two steps each; 3ⁿ states.
inline std::string TwoStepTasks(int n) {
  std::string text;
  for (int i = 0; i < n; ++i) {
    const std::string k = std::to_string(i);
    text += (i > 0 ? " & " : "") + ("F(a" + k + " & X[!] F b" + k + ")");
  }
  return text;
}

/// A random formula with about `size` operators over `atoms` atoms p0, p1, …; with `cosafe`, a co-safe one.
inline Formula RandomFormula(Random& random, int size, int atoms, bool cosafe) {
  const auto part = [&](int n) { return RandomFormula(random, n, atoms, cosafe); };
  if (size <= 0) {
    if (random.Index(12) == 0) return Formula::Constant(random.Index(2) == 0);
    const Formula atom = Formula::Atom("p" + std::to_string(random.Index(atoms)));
    return random.Index(3) == 0 ? Formula::Make(Operator::kNot, {atom}) : atom;
  }
  static constexpr Operator kCosafe[] = {Operator::kAnd,   Operator::kOr,         Operator::kEventually,
                                         Operator::kUntil, Operator::kStrongNext, Operator::kStrongRelease,
                                         Operator::kNext};
  static constexpr Operator kAll[] = {
      Operator::kNot,   Operator::kNext,    Operator::kStrongNext, Operator::kEventually,   Operator::kAlways,
      Operator::kUntil, Operator::kRelease, Operator::kWeakUntil,  Operator::kAnd,          Operator::kXor,
      Operator::kOr,    Operator::kImplies, Operator::kEquivalent, Operator::kStrongRelease};
  const Operator op = cosafe ? kCosafe[random.Index(7)] : kAll[random.Index(14)];
  switch (op) {
    case Operator::kNot:
    case Operator::kNext:
    case Operator::kStrongNext:
    case Operator::kEventually:
    case Operator::kAlways:
      return Formula::Make(op, {part(size - 1)});
    default: {
      const int left = random.Index(size);
      const Formula first = part(left);
      return Formula::Make(op, {first, part(size - 1 - left)});
    }
  }
}

inline Word RandomWord(Random& random, size_t length, size_t atoms) {
  Word word;
  for (size_t i = 0; i < length; ++i) {
    Letter letter(LetterWords(atoms));
    for (uint64_t& bits : letter) bits = random.Next() & random.Next();
    word.push_back(letter);
  }
  return word;
}

}  // namespace tether::ltl::testing
