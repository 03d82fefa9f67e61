#pragma once

#include <cstdint>
#include <vector>

#include "tether/ltl/automaton/triple_map.h"
#include "tether/ltl/formula/formula.h"

namespace tether::ltl {

/// A formula in the few operators that automata are made from, each distinct subformula once. Conjunction,
/// negation, strong next and until are enough: f | g = !(!f & !g), X f = !X[!] !f, F f = true U f, f R g =
/// !(!f U !g), f W g = g R (f | g), f M g = g U (f & g). Under Semantics::kCosafe negations are pushed down
/// to the atoms first, X being its own dual.
class Core {
 public:
  enum class Kind : uint8_t {
    kTrue,
    kAtom,
    kNegatedAtom,  ///< Under kCosafe only, where it needs a position; elsewhere a negated atom is !a.
    kAnd,
    kNext,  ///< Strong; of `left`.
    kUntil,
  };
  /// Twice the node's index, plus 1 if negated.
  using Ref = uint32_t;

  struct Node {
    Kind kind = Kind::kTrue;
    int atom = -1;
    Ref left = 0;
    Ref right = 0;
  };

  /// Throws InputError if `formula` can't be read with `semantics`.
  Core(const Formula& formula, Semantics semantics);

  static constexpr Ref kTrue = 0;
  static constexpr Ref kFalse = 1;
  static Ref Not(Ref f) { return f ^ 1; }
  static bool IsNegated(Ref f) { return (f & 1) != 0; }

  Ref root() const { return root_; }
  /// Operands come before their operator.
  const std::vector<Node>& nodes() const { return nodes_; }
  const Node& node(Ref f) const { return nodes_[f >> 1]; }
  int atoms() const { return atoms_; }

  /// Whether the empty word satisfies `f`.
  bool HoldsOnEmptyWord(Ref f) const { return empty_[f >> 1] != IsNegated(f); }
  /// Whether an operator other than the Boolean ones is below `f`.
  bool IsTemporal(Ref f) const { return temporal_[f >> 1]; }
  /// The operands of a conjunction, its nested ones flattened; `f` itself if it is none.
  std::vector<Ref> Conjuncts(Ref f) const;
  /// The atoms below `f`, in increasing order.
  std::vector<int> AtomsBelow(Ref f) const;

 private:
  Ref Add(Kind kind, int atom, Ref left, Ref right);
  Ref And(Ref f, Ref g);
  Ref Or(Ref f, Ref g) { return Not(And(Not(f), Not(g))); }
  Ref Until(Ref f, Ref g) { return Add(Kind::kUntil, -1, f, g); }
  Ref Translate(const Formula& formula, int node, bool positive);
  Ref TranslateNew(const Formula& formula, const Formula::Node& node, bool positive);

  bool cosafe_;
  int atoms_;
  std::vector<Node> nodes_;
  std::vector<bool> empty_;
  std::vector<bool> temporal_;
  TripleMap unique_;
  std::vector<Ref> memo_;  ///< Per formula node and polarity.
  Ref root_ = kTrue;
};

}  // namespace tether::ltl
