#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "tether/common/limits.h"
#include "tether/symbolic/grounding/fact_index.h"
#include "tether/symbolic/grounding/task.h"
#include "tether/symbolic/pddl/condition.h"
#include "tether/symbolic/pddl/pddl.h"

namespace tether::symbolic {

/// The objects of each combination of types, in file order.
class TypeIndex {
 public:
  explicit TypeIndex(const Problem& problem) : problem_(problem) {}
  /// The objects of one of these types.
  const std::vector<int>& ObjectsOf(const std::vector<int>& types);

 private:
  const Problem& problem_;
  std::map<std::vector<int>, std::vector<int>> objects_;
};

/// Turns formulas over variables into ground ones: quantifiers are expanded, and atoms that `ground_atom`
/// maps to constants are evaluated away.
class Instantiator {
 public:
  /// Returns a literal or a constant for a ground atom.
  using GroundAtom = std::function<GroundFormula(const Atom&)>;

  /// `limits` and `facts` must outlive this; LimitReached is thrown at the limits. For predicates that
  /// `facts` knows, `ground_atom` is also called for atoms that can't hold.
  Instantiator(const Problem& problem, const Limits& limits, const FactIndex& facts, GroundAtom ground_atom)
      : types_(problem), poller_(limits), facts_(facts), ground_atom_(std::move(ground_atom)) {}

  /// `binding` holds an object for each variable around `formula`.
  GroundFormula Instantiate(const Formula& formula, std::vector<int>& binding) {
    return Instantiate(formula, binding, true);
  }

  /// Calls `visit` for each choice of objects for `variables`, appended to `binding`; stops when it returns
  /// false.
  bool ForEach(const std::vector<TypedName>& variables, std::vector<int>& binding,
               const std::function<bool()>& visit);

  /// Visits all bindings, `binding` at their beginning, for which `formula` (or its negation, if not
  /// `positive`) may hold, until a visit returns false; few others where the facts say so.
  void ForEachMatch(const std::vector<TypedName>& variables, const Formula& formula, bool positive,
                    const std::vector<int>& binding, const std::function<bool(std::vector<int>&)>& visit);

  /// One step of work: polls the limits now and then.
  void CountStep() { poller_.Tick(); }

  /// The atom with its terms replaced by the objects of `binding`.
  static Atom Bind(int predicate, const std::vector<Term>& terms, const std::vector<int>& binding);

  TypeIndex& types() { return types_; }

 private:
  GroundFormula Instantiate(const Formula& formula, std::vector<int>& binding, bool positive);
  GroundFormula InstantiateQuantifier(const Formula& formula, const std::vector<int>& binding, bool positive);

  TypeIndex types_;
  LimitPoller poller_;
  const FactIndex& facts_;
  GroundAtom ground_atom_;
};

}  // namespace tether::symbolic
