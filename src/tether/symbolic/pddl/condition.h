#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace tether::symbolic {

/// A packed state: bit i is the truth of atom i, 64 to a word. Bits beyond the last atom are zero.
using State = std::vector<uint64_t>;
using StateView = std::span<const uint64_t>;

/// A ground formula in negation normal form over numbered atoms.
struct GroundFormula {
  enum class Kind { kTrue, kFalse, kLiteral, kAnd, kOr };

  Kind kind = Kind::kTrue;
  int atom = -1;         ///< kLiteral.
  bool positive = true;  ///< kLiteral.
  std::vector<GroundFormula> children;

  bool is_true() const { return kind == Kind::kTrue; }
  bool is_false() const { return kind == Kind::kFalse; }
  static GroundFormula Constant(bool value) { return {value ? Kind::kTrue : Kind::kFalse, -1, true, {}}; }
  static GroundFormula Literal(int atom, bool positive) { return {Kind::kLiteral, atom, positive, {}}; }
  /// Conjunction or disjunction, simplified: constants vanish, nested lists of the same kind are merged.
  static GroundFormula Join(Kind kind, std::vector<GroundFormula> children);
};

/// A ground formula compiled for fast tests: the necessary literals as masks, and the rest as trees.
class Condition {
 public:
  Condition() = default;  ///< True.
  explicit Condition(const GroundFormula& formula);

  bool Holds(StateView state) const;
  bool always() const { return formula_.is_true(); }
  bool never() const { return formula_.is_false(); }
  const GroundFormula& formula() const { return formula_; }

 private:
  struct WordTest {
    size_t word = 0;
    uint64_t must = 0;
    uint64_t must_not = 0;
  };

  std::vector<WordTest> tests_;
  std::vector<GroundFormula> rest_;
  GroundFormula formula_;
};

}  // namespace tether::symbolic
