#pragma once

#include <string>
#include <vector>

#include "tether/common/error.h"

namespace tether::symbolic {

/// A name with its types: a parameter, a quantified variable (without the '?'), a constant or an object. More
/// than one type means any of them (`either`); types are indices into Domain::types.
struct TypedName {
  std::string name;
  std::vector<int> types;
  Location where;
};

/// An argument: an object, or a variable. Variables are numbered from the outside in: first the action's
/// parameters, then those of each quantifier around the place, so that a binding is a list of objects that
/// grows and shrinks at its end.
struct Term {
  bool is_variable = false;
  int index = 0;  ///< Index of the object (constants first), or number of the variable.

  bool operator==(const Term&) const = default;
};

/// A formula of first-order logic over the objects.
struct Formula {
  enum class Kind { kAtom, kEquals, kNot, kAnd, kOr, kImply, kForall, kExists };

  Kind kind = Kind::kAnd;            ///< An `and` of nothing is true.
  int predicate = -1;                ///< kAtom.
  std::vector<Term> terms;           ///< kAtom, kEquals (two).
  std::vector<TypedName> variables;  ///< kForall, kExists.
  std::vector<Formula> children;     ///< kNot, kForall, kExists: one; kImply: two; kAnd, kOr: any number.
  Location where;
};

/// What an action does. All conditions are read in the state before; deletions come before additions.
struct Effect {
  enum class Kind { kAdd, kDelete, kAnd, kForall, kWhen };

  Kind kind = Kind::kAnd;
  int predicate = -1;                ///< kAdd, kDelete.
  std::vector<Term> terms;           ///< kAdd, kDelete.
  std::vector<TypedName> variables;  ///< kForall.
  Formula condition;                 ///< kWhen.
  std::vector<Effect> children;      ///< kForall, kWhen: one; kAnd: any number.
  Location where;
};

}  // namespace tether::symbolic
