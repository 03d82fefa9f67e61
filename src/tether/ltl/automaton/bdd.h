#pragma once

#include <cstdint>
#include <vector>

#include "tether/ltl/automaton/triple_map.h"

namespace tether::ltl {

/// Reduced ordered binary decision diagrams with complemented edges (Bryant, 1986; Brace, Rudell and Bryant,
/// 1990). Variables are levels, tested in increasing order. Equal functions have equal Refs.
class Bdd {
 public:
  using Ref = uint32_t;  ///< Twice the node's index, plus 1 if negated.
  static constexpr Ref kTrue = 0;
  static constexpr Ref kFalse = 1;
  static constexpr int kTerminalLevel = 0x7fffffff;

  /// Thrown when a diagram would exceed the limit on nodes; caught where the limit is set.
  struct TooLarge {};

  explicit Bdd(size_t max_nodes = SIZE_MAX);

  static Ref Not(Ref f) { return f ^ 1; }
  static bool IsConstant(Ref f) { return f < 2; }

  Ref Var(int level) { return MakeNode(level, kFalse, kTrue); }
  Ref And(Ref f, Ref g) { return Ite(f, g, kFalse); }
  Ref Or(Ref f, Ref g) { return Ite(f, kTrue, g); }
  /// f ? g : h.
  Ref Ite(Ref f, Ref g, Ref h);
  /// The function that tests `level` first; both branches must be of later levels.
  Ref MakeNode(int level, Ref low, Ref high);

  /// Of the top variable; kTerminalLevel for constants.
  int Level(Ref f) const { return nodes_[f >> 1].level; }
  /// The branches where the top variable is false or true. `f` is not constant.
  Ref Low(Ref f) const { return nodes_[f >> 1].low ^ (f & 1); }
  Ref High(Ref f) const { return nodes_[f >> 1].high ^ (f & 1); }

  size_t size() const { return nodes_.size(); }

 private:
  struct Node {
    int level;
    Ref low;
    Ref high;  ///< Never complemented: what makes the form canonical.
  };

  Ref LowAt(Ref f, int level) const { return Level(f) == level ? Low(f) : f; }
  Ref HighAt(Ref f, int level) const { return Level(f) == level ? High(f) : f; }

  size_t max_nodes_;
  std::vector<Node> nodes_;
  TripleMap unique_;
  TripleMap ite_cache_;
};

}  // namespace tether::ltl
