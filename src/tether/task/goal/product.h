#pragma once

#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tether/common/error.h"
#include "tether/common/id.h"
#include "tether/ltl/automaton/lazy_automaton.h"
#include "tether/symbolic/grounding/task.h"

namespace tether::task {

/// A temporal goal: a formula on the word of a plan, the facts that hold after each of its actions.
struct TemporalGoal {
  ltl::Formula formula;
  ltl::Semantics semantics = ltl::Semantics::kCosafe;
  Location where;  ///< Of the formula's text, if it stands in a file.
  /// Letters that were read before the initial state: what is planned goes on with a word that has begun.
  ltl::Word read = {};
};

/// The reason given for a goal whose automaton accepts nothing.
inline constexpr const char* kUnsatisfiable =
    "the formula is unsatisfiable: no sequence of states makes it true";

/// For each proposition of the formula the atom of the task that it names, as on(box,table), in any case;
/// kAlways or kNever if that can't change.
struct Propositions {
  static constexpr int kNever = -1;
  static constexpr int kAlways = -2;
  /// Throws InputError with a mistake for each proposition that is not a ground atom of the task.
  static std::vector<int> Resolve(const symbolic::Task& task, const TemporalGoal& goal);
};

/// The product of a task's state space and its goal's automaton (paper B, section 3). The goal is the
/// problem's own, or a temporal one in its place. A state is the task's, followed by a 64-bit word with the
/// number of the automaton's state if there is one. Apply() creates states of the automaton: not for several
/// threads at once.
class Product {
 public:
  /// Throws InputError if the temporal goal can't be read or names what does not exist.
  explicit Product(std::shared_ptr<const symbolic::Task> task, std::optional<TemporalGoal> goal = {});

  const symbolic::Task& task() const { return *task_; }
  /// No word at all satisfies the temporal goal.
  bool IsUnsatisfiable() const { return automaton_ && automaton_->IsTrap(ltl::LazyAutomaton::initial()); }
  /// 64-bit words of a state.
  size_t words() const { return task_->words() + (automaton_ ? 1 : 0); }
  /// The initial state, or that after BeginAfter(); empty if the goal is lost there already.
  std::optional<symbolic::State> Start();
  /// From now on Start() is the state after these actions, which must be applicable one after another. Call
  /// it before anything is made from this product.
  void BeginAfter(std::vector<ActionId> actions) { done_ = std::move(actions); }
  void FindApplicable(symbolic::StateView state, std::vector<ActionId>& actions) const {
    task_->FindApplicable(state.first(task_->words()), actions);
    if (!forbidden_.empty()) std::erase_if(actions, [&](ActionId action) { return IsForbidden(action); });
  }
  /// The state after an applicable action; false if the goal is lost there.
  bool Apply(ActionId action, symbolic::StateView state, std::span<uint64_t> next);
  bool IsGoal(symbolic::StateView state) const;

  /// From now on the action is never applicable. Call it before anything is made from this product.
  void Forbid(ActionId action) {
    forbidden_.resize(task_->actions().size(), false);
    forbidden_[action] = true;
  }
  bool IsForbidden(ActionId action) const { return !forbidden_.empty() && forbidden_[action]; }

  /// Null for the problem's own goal.
  const TemporalGoal* goal() const { return goal_ ? &*goal_ : nullptr; }
  const ltl::LazyAutomaton* automaton() const { return automaton_.get(); }
  int AutomatonState(symbolic::StateView state) const { return static_cast<int>(state[task_->words()]); }
  /// Atoms of the task by proposition, as Propositions says.
  const std::vector<int>& propositions() const { return propositions_; }

 private:
  bool Read(int automaton_state, std::span<uint64_t> state);

  std::shared_ptr<const symbolic::Task> task_;
  std::optional<TemporalGoal> goal_;
  std::vector<ActionId> done_;               ///< Before the start.
  IndexedVector<ActionId, bool> forbidden_;  ///< Empty: none.
  std::unique_ptr<ltl::LazyAutomaton> automaton_;
  std::vector<int> propositions_;
  ltl::Letter letter_;
};

}  // namespace tether::task
