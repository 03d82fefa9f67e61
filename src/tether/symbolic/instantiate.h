#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "tether/common/limits.h"
#include "tether/symbolic/condition.h"
#include "tether/symbolic/pddl.h"
#include "tether/symbolic/task.h"

namespace tether::symbolic {

/// The objects of each combination of types, in file order.
class TypeIndex {
 public:
  explicit TypeIndex(const Problem& problem) : problem_(problem) {}
  const std::vector<int>& ObjectsOf(const std::vector<int>& types);

 private:
  const Problem& problem_;
  std::map<std::vector<int>, std::vector<int>> objects_;
};

/// Turns formulas over variables into ground ones: quantifiers are written out, and what `ground_atom` knows
/// is evaluated away.
class Instantiator {
 public:
  /// Returns a literal or a constant for a ground atom.
  using GroundAtom = std::function<GroundFormula(const Atom&)>;

  /// `limits` must outlive this; LimitReached is thrown where they are.
  Instantiator(const Problem& problem, const Limits& limits, GroundAtom ground_atom)
      : types_(problem), poller_(limits), ground_atom_(std::move(ground_atom)) {}

  /// `binding` holds an object for each variable around `formula`.
  GroundFormula Instantiate(const Formula& formula, std::vector<int>& binding) {
    return Instantiate(formula, binding, true);
  }

  /// Calls `visit` for each choice of objects for `variables`, appended to `binding`; stops when it returns
  /// false.
  bool ForEach(const std::vector<TypedName>& variables, std::vector<int>& binding,
               const std::function<bool()>& visit);

  /// One step of work: looks at the limits now and then.
  void CountStep() { poller_.Tick(); }

  static Atom Bind(int predicate, const std::vector<Term>& terms, const std::vector<int>& binding);

  TypeIndex& types() { return types_; }

 private:
  GroundFormula Instantiate(const Formula& formula, std::vector<int>& binding, bool positive);

  TypeIndex types_;
  LimitPoller poller_;
  GroundAtom ground_atom_;
};

}  // namespace tether::symbolic
