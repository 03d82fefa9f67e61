#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

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

  Instantiator(const Problem& problem, GroundAtom ground_atom)
      : types_(problem), ground_atom_(std::move(ground_atom)) {}

  /// `binding` holds an object for each variable around `formula`. Throws InputError, at the place of the
  /// formula, when it would become too large.
  GroundFormula Instantiate(const Formula& formula, std::vector<int>& binding) {
    return Instantiate(formula, binding, true);
  }

  /// Calls `visit` for each choice of objects for `variables`, appended to `binding`; stops when it returns
  /// false.
  bool ForEach(const std::vector<TypedName>& variables, std::vector<int>& binding, const Location& where,
               const std::function<bool()>& visit);

  /// Counts one step of work against the limit; throws InputError, at `where`, beyond it.
  void CountStep(const Location& where);

  static Atom Bind(int predicate, const std::vector<Term>& terms, const std::vector<int>& binding);

  TypeIndex& types() { return types_; }

 private:
  GroundFormula Instantiate(const Formula& formula, std::vector<int>& binding, bool positive);

  TypeIndex types_;
  GroundAtom ground_atom_;
  int64_t steps_ = 0;
};

}  // namespace tether::symbolic
