#pragma once

#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "tether/symbolic/grounding/task.h"
#include "tether/symbolic/pddl/formula.h"

namespace tether::symbolic {

class TypeIndex;

/// The atoms of some predicates that may hold, found by the object at an argument.
class FactIndex {
 public:
  /// Of a predicate that is not `known`, anything may hold.
  FactIndex(const Problem& problem, std::vector<bool> known);

  /// The atom may hold from now on.
  void Add(const Atom& atom);
  bool IsKnown(int predicate) const { return known_[predicate]; }
  /// Those that may match an atom whose variables are bound where `binding` is not negative; some that do not
  /// match may be among them.
  const std::vector<std::vector<int>>& facts(int predicate) const { return relations_[predicate].facts; }
  /// Indices in facts(predicate) of the atoms that may match `atom` under `binding` (negative: not bound).
  const std::vector<int>& Candidates(const Formula& atom, const std::vector<int>& binding) const;

 private:
  struct Relation {
    std::vector<std::vector<int>> facts;                ///< Arguments.
    std::vector<int> all;                               ///< 0, 1, …
    std::vector<std::map<int, std::vector<int>>> with;  ///< [position][object]: indices of facts.
  };

  std::vector<bool> known_;
  std::vector<Relation> relations_;
  std::vector<int> none_;
};

/// A formula that has to hold, or that must not.
struct Literal {
  const Formula* formula = nullptr;
  bool positive = true;
};

/// The conjuncts of `formula` (of its negation, if not `positive`).
std::vector<Literal> Conjuncts(const Formula& formula, bool positive);

/// Visits all bindings of `variables`, appended to `binding`, for which none of `conjuncts` is known to fail,
/// in lexicographic order, until a visit returns false. Facts that may hold are joined: the conjunct with the
/// fewest facts comes next. `fails` is asked of literals (atoms of known predicates and equalities) as soon
/// as their variables are bound; `step` is called once per step of work.
void JoinVariables(const FactIndex& facts, TypeIndex& types, const std::vector<TypedName>& variables,
                   const std::vector<Literal>& conjuncts, const std::vector<int>& binding,
                   const std::function<bool(const Literal&, const std::vector<int>&)>& fails,
                   const std::function<void()>& step, const std::function<bool(std::vector<int>&)>& visit);

}  // namespace tether::symbolic
