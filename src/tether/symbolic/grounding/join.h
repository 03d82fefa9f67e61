#pragma once

#include <functional>
#include <span>
#include <unordered_map>
#include <vector>

#include "tether/symbolic/grounding/instantiate.h"
#include "tether/symbolic/grounding/task.h"

namespace tether::symbolic {

struct AtomHash {
  size_t operator()(const Atom& atom) const;
};

/// Numbers atoms in the order in which they are first met.
class AtomTable {
 public:
  /// The number of `atom`, a new one if it was never met.
  int Number(const Atom& atom);
  /// -1 if it was never met.
  int Find(const Atom& atom) const;
  int size() const { return static_cast<int>(numbers_.size()); }
  const Atom& atom(int number) const { return *atoms_[number]; }

 private:
  std::unordered_map<Atom, int, AtomHash> numbers_;
  std::vector<const Atom*> atoms_;
};

/// A rule to be matched: its bindings are those of the parameters for which the patterns are among the facts
/// and no test is false.
struct JoinRule {
  struct Pattern {
    int predicate = -1;
    std::vector<Term> terms;
  };
  struct Test {
    const Formula* formula = nullptr;  ///< Over atoms that never change.
    std::vector<int> variables;        ///< The parameters in it.
  };
  const std::vector<TypedName>* parameters = nullptr;
  std::vector<Pattern> patterns;
  std::vector<Test> tests;
};

/// A set of facts that grows, and the matching of rules with it: at each point the pattern with the fewest
/// facts that may match comes next, found by an index on each argument.
class Join {
 public:
  using Visit = std::function<void(std::vector<int>& binding)>;

  /// All must outlive the join.
  Join(const Problem& problem, const AtomTable& table, Instantiator& instantiator);

  void AddFact(int number);
  /// All bindings.
  void Match(const JoinRule& rule, const Visit& visit);
  /// Those that need fact `number`: pattern `trigger` is it, and no earlier pattern is. So each binding comes
  /// once if each fact is asked for, right after it was added, with every pattern.
  void Match(const JoinRule& rule, int trigger, int number, const Visit& visit);

 private:
  struct Relation {
    std::vector<int> facts;
    std::vector<std::vector<std::vector<int>>> by_argument;  ///< [position][object]: facts.
  };

  void Begin(const JoinRule& rule);
  void Extend(const JoinRule& rule, const Visit& visit);
  /// Binds the variables by the fact; false if it does not fit. In both cases Undo(mark) reverses it.
  bool Unify(const JoinRule& rule, const JoinRule::Pattern& pattern, const Atom& fact);
  bool Bind(const JoinRule& rule, int variable, int object);
  void Undo(const JoinRule& rule, size_t mark);
  /// The facts that may match the pattern as far as it is bound.
  const std::vector<int>& Candidates(const JoinRule::Pattern& pattern) const;

  const Problem& problem_;
  const AtomTable& table_;
  Instantiator& instantiator_;
  std::vector<Relation> relations_;
  std::vector<std::vector<bool>> of_type_;  ///< [type][object].

  std::vector<int> binding_;
  std::vector<int> trail_;  ///< Variables in the order in which they were bound.
  std::vector<bool> used_;  ///< Per pattern.
  std::vector<int> waits_;  ///< Per test: its variables that are not bound.
  int trigger_ = -1, trigger_fact_ = -1;
};

}  // namespace tether::symbolic
