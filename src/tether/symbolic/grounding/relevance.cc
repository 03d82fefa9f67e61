#include "tether/symbolic/grounding/relevance.h"

#include <algorithm>
#include <utility>

namespace tether::symbolic {

class RelevanceFinder {
 public:
  explicit RelevanceFinder(const Task& task)
      : task_(task), acts_(task.actions().size(), false), true_(task.atoms().size(), false), false_(true_) {}

  RelevantTask Run() {
    Ask(task_.goal().formula(), true);
    do {
      changed_ = false;
      for (const ActionId action : task_.actions().ids()) AskForAction(action);
      for (const std::vector<GroundAxiom>& stratum : task_.axioms()) {
        for (const GroundAxiom& axiom : stratum) {
          if (Asked(true_, axiom.atom)) Ask(axiom.body.formula(), true);
          if (Asked(false_, axiom.atom)) Ask(axiom.body.formula(), false);
        }
      }
    } while (changed_);
    return Make();
  }

 private:
  static bool Asked(const std::vector<bool>& asked, int atom) { return asked[atom]; }
  static bool AnyAsked(const std::vector<bool>& asked, const std::vector<int>& atoms) {
    return std::any_of(atoms.begin(), atoms.end(), [&](int atom) { return Asked(asked, atom); });
  }

  /// `formula` is asked to hold, or to fail.
  void Ask(const GroundFormula& formula, bool holds) {
    if (formula.kind == GroundFormula::Kind::kLiteral) {
      std::vector<bool>::reference asked = (formula.positive == holds ? true_ : false_)[formula.atom];
      changed_ = changed_ || !asked;
      asked = true;
    }
    for (const GroundFormula& child : formula.children) Ask(child, holds);
  }

  void AskForAction(ActionId index) {
    const GroundAction& action = task_.actions()[index];
    for (const GroundEffect& effect : action.effects) {
      if (AnyAsked(true_, effect.adds) || AnyAsked(false_, effect.deletes)) {
        changed_ = changed_ || !acts_[index];
        acts_[index] = true;
        Ask(effect.condition.formula(), true);
      }
    }
    if (!acts_[index]) return;
    Ask(action.precondition.formula(), true);
    for (const GroundEffect& effect : action.effects) {
      if (AnyAsked(false_, effect.adds) || AnyAsked(true_, effect.deletes))
        Ask(effect.condition.formula(), false);
    }
  }

  GroundFormula Renumber(const GroundFormula& formula) const {
    GroundFormula renumbered = formula;
    if (formula.kind == GroundFormula::Kind::kLiteral) renumbered.atom = number_[formula.atom];
    for (GroundFormula& child : renumbered.children) child = Renumber(child);
    return renumbered;
  }

  std::vector<int> Renumber(const std::vector<int>& atoms) const {
    std::vector<int> kept;
    for (int atom : atoms) {
      if (number_[atom] >= 0) kept.push_back(number_[atom]);
    }
    return kept;
  }

  RelevantTask Make() {
    RelevantTask relevant;
    std::shared_ptr<Task> task(new Task());
    task->problem_ = task_.problem_;
    task->constant_atoms_ = task_.constant_atoms_;
    task->cost_unit_ = task_.cost_unit_;
    for (size_t i = 0; i < task_.atoms().size(); ++i) {
      const bool kept = true_[i] || false_[i];
      number_.push_back(kept ? static_cast<int>(task->atoms_.size()) : -1);
      if (kept) task->atoms_.push_back(task_.atoms()[i]);
    }
    task->initial_state_.assign(std::max<size_t>(1, (task->atoms_.size() + 63) / 64), 0);
    for (size_t i = 0; i < number_.size(); ++i) {
      if (number_[i] < 0 || (task_.initial_state_[i / 64] >> (i % 64) & 1) == 0) continue;
      const auto atom = static_cast<size_t>(number_[i]);
      task->initial_state_[atom / 64] |= uint64_t{1} << (atom % 64);
    }
    for (const ActionId i : task_.actions().ids()) {
      if (!acts_[i]) continue;
      GroundAction action = task_.actions()[i];
      action.precondition = Condition(Renumber(action.precondition.formula()));
      action.effects.clear();
      for (const GroundEffect& effect : task_.actions()[i].effects) {
        std::vector<int> deletes = Renumber(effect.deletes), adds = Renumber(effect.adds);
        if (deletes.empty() && adds.empty()) continue;
        action.effects.push_back(
            {Condition(Renumber(effect.condition.formula())), std::move(deletes), std::move(adds)});
      }
      task->AddAction(std::move(action));
      relevant.actions.push_back(i);
    }
    for (const std::vector<GroundAxiom>& stratum : task_.axioms()) {
      task->axioms_.emplace_back();
      for (const GroundAxiom& axiom : stratum) {
        const int atom = number_[axiom.atom];
        if (atom < 0) continue;
        task->axioms_.back().push_back({atom, Condition(Renumber(axiom.body.formula()))});
        task->derived_.resize(task->initial_state_.size(), 0);
        task->derived_[static_cast<size_t>(atom) / 64] |= uint64_t{1} << (atom % 64);
      }
    }
    task->goal_ = Condition(Renumber(task_.goal().formula()));
    task->IndexActions();
    relevant.task = std::move(task);
    return relevant;
  }

  const Task& task_;
  IndexedVector<ActionId, bool> acts_;  ///< It is kept.
  std::vector<bool> true_, false_;      ///< By atom: this value is relevant.
  bool changed_ = false;
  std::vector<int> number_;  ///< By atom: its number in the new task, -1 if it is left out.
};

RelevantTask KeepRelevant(const std::shared_ptr<const Task>& whole) {
  RelevantTask relevant = RelevanceFinder(*whole).Run();
  if (relevant.task->actions().size() == whole->actions().size() &&
      relevant.task->atoms().size() == whole->atoms().size())
    relevant.task = whole;
  return relevant;
}

}  // namespace tether::symbolic
