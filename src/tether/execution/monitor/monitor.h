#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tether/execution/observer/fact_observer.h"
#include "tether/symbolic/grounding/task.h"
#include "tether/task/goal/product.h"

namespace tether::execution {

/// Whether what is left of a plan still reaches the goal from what is observed.
struct PlanOutlook {
  bool reaches = true;
  std::string reason;  ///< If not: what changed, and which action can't be done or that the goal is missed.
};

/// Keeps what is believed about the symbolic state: effects of the actions that were done, corrected by what
/// is observed and lasts. A fact that geometry contradicts from the start is not corrected until both agree:
/// `:init` is authoritative.
class Monitor {
 public:
  /// The scene must outlive the monitor. `actions`: the plan's. A temporal `goal` takes the place of the
  /// task's own.
  Monitor(const scene::Scene& scene, std::shared_ptr<const symbolic::Task> task,
          const std::vector<std::string>& actions, std::optional<task::TemporalGoal> goal = {},
          const FactObserverOptions& options = {});

  /// Looks at the facts when it is time. Atoms that action `running` of the plan changes are left alone; −1:
  /// none runs.
  void Observe(double time, const IndexedVector<ObjectId, control::MovingPose>& objects, ObjectId held,
               int running);
  /// Whether poses are exact and not late: then changes count at once.
  void set_exact(bool exact) { observer_.set_exact(exact); }
  /// The plan's action has been done.
  void Finish(int action);
  /// The plan goes on with `actions` from its action `first` on, which `task` has, from its initial state.
  /// The letters that a temporal `goal` has read are those before that state.
  void Adopt(std::shared_ptr<const symbolic::Task> task, const std::vector<std::string>& actions, int first,
             std::optional<task::TemporalGoal> goal = {});

  /// What facts are named by.
  std::shared_ptr<const symbolic::Problem> problem() const { return {task_, &task_->problem()}; }
  /// Something was corrected since the plan was looked at last.
  bool changed() const { return changed_; }
  /// What becomes of the plan from action `next` on.
  PlanOutlook Look(int next);
  /// What is believed and seen at this moment, as the initial state of a problem.
  std::vector<symbolic::Fact> Facts(double time, const IndexedVector<ObjectId, control::MovingPose>& objects,
                                    ObjectId held);
  /// The temporal goal, if there is one, with the letters from the start and after each action that was done,
  /// up to the last that was before the present state.
  std::optional<task::TemporalGoal> Goal() const;

 private:
  struct Belief {
    int atom = -1;  ///< Of the task; −1: a constant there.
    bool constant = false;
    bool trusted = false;  ///< Geometry and what is believed have agreed before.
  };

  bool Believed(size_t fact) const;
  ltl::Letter LetterOf(const symbolic::State& state) const;
  /// Whether the temporal goal is true of the word so far and what follows from the present state on.
  bool Accepts(const std::vector<symbolic::State>& states) const;

  FactObserver observer_;
  std::shared_ptr<const symbolic::Task> task_;
  symbolic::State state_;
  std::vector<Belief> beliefs_;  ///< By fact of the observer.
  int first_ = 0;
  std::vector<ActionId> actions_;         ///< From action first_ of the plan on.
  std::vector<std::string> corrections_;  ///< Since the plan was adopted.
  /// Facts that the task holds to be impossible, and that are so.
  std::vector<size_t> unforeseen_;
  bool changed_ = false;

  std::optional<task::TemporalGoal> goal_;
  std::unique_ptr<ltl::LazyAutomaton> automaton_;  ///< Of the temporal goal; null: the task's own counts.
  std::vector<int> propositions_;                  ///< Atoms of the task by atom of the formula.
  ltl::Word word_;                                 ///< At the start and after each action that was done.
};

}  // namespace tether::execution
