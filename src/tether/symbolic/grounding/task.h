#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tether/common/id.h"
#include "tether/common/limits.h"
#include "tether/symbolic/pddl/condition.h"
#include "tether/symbolic/pddl/pddl.h"

namespace tether::symbolic {

/// A predicate with its arguments.
struct Atom {
  int predicate = -1;
  std::vector<int> arguments;  ///< Indices into Problem::objects.

  auto operator<=>(const Atom&) const = default;
};

/// Part of what a ground action does: atoms made false, then atoms made true, where the condition held in the
/// state before.
struct GroundEffect {
  Condition condition;
  std::vector<int> deletes;
  std::vector<int> adds;
};

struct GroundAction {
  int schema = -1;             ///< Index into Domain::actions.
  std::vector<int> arguments;  ///< Indices into Problem::objects.
  std::string name;            ///< "push(hook,box,table)", in the spelling of the files.
  Condition precondition;
  std::vector<GroundEffect> effects;
  int64_t cost = 1;  ///< In Task::cost_unit().
};

/// A derived atom holds where the body of one of its axioms does.
struct GroundAxiom {
  int atom = -1;
  Condition body;
};

/// A grounded problem. Atoms that can't change are evaluated away, and actions that can't be reached even
/// when nothing is ever deleted are left out. States hold the derived atoms too. Immutable: safe to share
/// between threads.
class Task {
 public:
  /// Throws InputError when a cost is not given, and LimitReached at a limit.
  static std::shared_ptr<const Task> Ground(std::shared_ptr<const Problem> problem,
                                            const Limits& limits = {});

  const Problem& problem() const { return *problem_; }
  const std::shared_ptr<const Problem>& shared_problem() const { return problem_; }
  const Domain& domain() const { return *problem_->domain; }

  /// The atoms that can change, ordered by predicate, then arguments.
  const std::vector<Atom>& atoms() const { return atoms_; }
  /// Ordered by schema, then arguments, each in file order.
  const IndexedVector<ActionId, GroundAction>& actions() const { return actions_; }
  const State& initial_state() const { return initial_state_; }
  const Condition& goal() const { return goal_; }
  /// 64-bit words of a state; at least 1.
  size_t words() const { return initial_state_.size(); }

  /// Costs of actions are whole multiples of this, so that sums are exact.
  double cost_unit() const { return cost_unit_; }
  /// By stratum: those of a lower one are settled before those of a higher one.
  const std::vector<std::vector<GroundAxiom>>& axioms() const { return axioms_; }
  bool IsDerived(int atom) const { return domain().IsDerived(atoms_[static_cast<size_t>(atom)].predicate); }

  /// The actions whose precondition holds, in their order. `actions` is overwritten.
  void FindApplicable(StateView state, std::vector<ActionId>& actions) const;
  bool IsApplicable(ActionId action, StateView state) const {
    return actions_[action].precondition.Holds(state);
  }
  /// The state after `action`, whose precondition must hold in `state`. `next` has words() words and is not
  /// `state`.
  void Apply(ActionId action, StateView state, std::span<uint64_t> next) const;
  State Apply(ActionId action, const State& state) const;
  bool IsGoal(StateView state) const { return goal_.Holds(state); }

  /// The action of that name, such as "pick(hook)", in the spelling of the files; not valid if there is none.
  ActionId FindAction(std::string_view name) const;
  /// Index of a changing atom, -1 if it can't change; HoldsAlways() then gives its value.
  int FindAtom(const Atom& atom) const;
  bool HoldsAlways(const Atom& atom) const;
  bool Holds(const Atom& atom, StateView state) const;

  /// Grounds a formula without free variables, parsed against this problem.
  Condition Compile(const Formula& formula, const Limits& limits = {}) const;

  /// "on(box,table)".
  std::string AtomName(const Atom& atom) const;
  /// Names of the atoms that hold in `state`, in the order of atoms; with `with_constant` also those that
  /// never change.
  std::vector<std::string> TrueAtoms(StateView state, bool with_constant = false) const;

 private:
  friend class Grounder;
  friend class RelevanceFinder;
  Task() = default;

  /// Sets the derived atoms to what follows from the others.
  void Derive(std::span<uint64_t> state) const;
  /// Appends an action whose numbers are the task's.
  void AddAction(GroundAction action);
  void IndexActions();

  /// An effect as masks on one word.
  struct WordChange {
    size_t word = 0;
    uint64_t deletes = 0;
    uint64_t adds = 0;
  };
  struct Change {
    bool conditional = false;
    std::vector<WordChange> words;
  };

  std::shared_ptr<const Problem> problem_;
  std::vector<Atom> atoms_;
  std::vector<Atom> constant_atoms_;  ///< True in every reachable state; sorted.
  IndexedVector<ActionId, GroundAction> actions_;
  std::map<std::string, ActionId, std::less<>> action_index_;
  IndexedVector<ActionId, std::vector<Change>> changes_;  ///< One per effect.
  std::vector<std::vector<GroundAxiom>> axioms_;
  State derived_;  ///< Which atoms are derived; empty if none is.
  /// Actions by an atom that must be true: those of atom i from first_watcher_[i] on. The last list has the
  /// actions that need none.
  std::vector<size_t> first_watcher_;
  std::vector<ActionId> watchers_;
  double cost_unit_ = 1;
  State initial_state_;
  Condition goal_;
};

}  // namespace tether::symbolic
