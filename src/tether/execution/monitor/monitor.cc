#include "tether/execution/monitor/monitor.h"

#include <algorithm>

#include "tether/ltl/formula/formula.h"

namespace tether::execution {
namespace {

void Set(symbolic::State& state, int atom, bool value) {
  const uint64_t bit = uint64_t{1} << (ToIndex(atom) % 64);
  if (value)
    state[ToIndex(atom) / 64] |= bit;
  else
    state[ToIndex(atom) / 64] &= ~bit;
}

bool Changes(const symbolic::GroundAction& action, int atom) {
  return std::any_of(action.effects.begin(), action.effects.end(), [&](const symbolic::GroundEffect& effect) {
    return std::find(effect.adds.begin(), effect.adds.end(), atom) != effect.adds.end() ||
           std::find(effect.deletes.begin(), effect.deletes.end(), atom) != effect.deletes.end();
  });
}

}  // namespace

Monitor::Monitor(const scene::Scene& scene, std::shared_ptr<const symbolic::Task> task,
                 const std::vector<std::string>& actions, std::optional<task::TemporalGoal> goal,
                 const FactObserverOptions& options)
    : observer_(scene, *task, options) {
  Adopt(std::move(task), actions, 0, std::move(goal));
}

void Monitor::Adopt(std::shared_ptr<const symbolic::Task> task, const std::vector<std::string>& actions,
                    int first, std::optional<task::TemporalGoal> goal) {
  task_ = std::move(task);
  goal_ = std::move(goal);
  automaton_.reset();
  word_.clear();
  if (goal_) {
    automaton_ = std::make_unique<ltl::LazyAutomaton>(goal_->formula, goal_->semantics);
    propositions_ = task::Propositions::Resolve(*task_, *goal_);
    word_ = goal_->read;
    word_.push_back(LetterOf(task_->initial_state()));
  }
  state_ = task_->initial_state();
  first_ = first;
  actions_.clear();
  for (const std::string& action : actions) actions_.push_back(task_->FindAction(action));
  beliefs_.resize(observer_.facts().size());
  for (size_t i = 0; i < beliefs_.size(); ++i) {
    const symbolic::Fact& fact = observer_.facts()[i].fact;
    const symbolic::Atom atom{fact.predicate, fact.arguments};
    beliefs_[i].atom = task_->FindAtom(atom);
    beliefs_[i].constant = beliefs_[i].atom < 0 && task_->HoldsAlways(atom);
  }
  corrections_.clear();
  unforeseen_.clear();
  changed_ = false;
}

bool Monitor::Believed(size_t fact) const {
  const Belief& belief = beliefs_[fact];
  if (belief.atom >= 0) return ltl::IsTrue(state_, belief.atom);
  const bool odd = std::find(unforeseen_.begin(), unforeseen_.end(), fact) != unforeseen_.end();
  return belief.constant != odd;
}

void Monitor::Observe(double time, const IndexedVector<ObjectId, control::MovingPose>& objects, ObjectId held,
                      int running) {
  if (!observer_.Look(time, objects, held)) return;
  const int index = running - first_;
  const ActionId action = running >= 0 && index >= 0 && index < static_cast<int>(actions_.size())
                              ? actions_[ToIndex(index)]
                              : ActionId();
  for (size_t i = 0; i < beliefs_.size(); ++i) {
    Belief& belief = beliefs_[i];
    const ObservableFact& fact = observer_.facts()[i];
    if (fact.value == Believed(i)) {
      belief.trusted = true;
      continue;
    }
    if (!belief.trusted || fact.seen != fact.value) continue;
    if (action.valid() && belief.atom >= 0 && Changes(task_->actions()[action], belief.atom)) continue;
    if (belief.atom >= 0) {
      Set(state_, belief.atom, fact.value);
    } else if (fact.value != belief.constant) {
      unforeseen_.push_back(i);
    } else {
      std::erase(unforeseen_, i);
    }
    corrections_.push_back(fact.text + (fact.value ? " holds" : " no longer holds"));
    changed_ = true;
  }
}

void Monitor::Finish(int action) {
  const int index = action - first_;
  if (index < 0 || index >= static_cast<int>(actions_.size())) return;
  const ActionId done = actions_[ToIndex(index)];
  if (!done.valid() || !task_->IsApplicable(done, state_)) return;
  state_ = task_->Apply(done, state_);
  if (goal_) word_.push_back(LetterOf(state_));
}

ltl::Letter Monitor::LetterOf(const symbolic::State& state) const {
  ltl::Letter letter(automaton_->letter_words(), 0);
  for (size_t i = 0; i < propositions_.size(); ++i) {
    const int atom = propositions_[i];
    if (atom >= 0 ? ltl::IsTrue(state, atom) : atom == task::Propositions::kAlways)
      letter[i / 64] |= uint64_t{1} << (i % 64);
  }
  return letter;
}

std::optional<task::TemporalGoal> Monitor::Goal() const {
  if (!goal_) return std::nullopt;
  task::TemporalGoal goal = *goal_;
  goal.read = word_;
  if (word_.back() == LetterOf(state_)) goal.read.pop_back();
  return goal;
}

bool Monitor::Accepts(const std::vector<symbolic::State>& states) const {
  int at = ltl::LazyAutomaton::initial();
  for (const ltl::Letter& letter : word_) at = automaton_->Step(at, ltl::LetterView(letter));
  for (size_t i = 0; i < states.size(); ++i) {
    const ltl::Letter letter = LetterOf(states[i]);
    // What was changed by others is a letter of its own.
    if (i > 0 || letter != word_.back()) at = automaton_->Step(at, ltl::LetterView(letter));
  }
  return automaton_->IsAccepting(at);
}

PlanOutlook Monitor::Look(int next) {
  changed_ = false;
  std::string because;
  for (const std::string& correction : corrections_) {
    if (because.find(correction) != std::string::npos) continue;
    because += (because.empty() ? "" : ", ") + correction;
  }
  const auto fails = [&](const std::string& what) {
    return PlanOutlook{false, because.empty() ? what : because + ": " + what};
  };
  if (!unforeseen_.empty()) return fails("the plan did not foresee that");
  std::vector<symbolic::State> states{state_};
  for (size_t i = ToIndex(std::max(0, next - first_)); i < actions_.size(); ++i) {
    if (!actions_[i].valid()) return fails("an action of the plan is unknown");
    if (!task_->IsApplicable(actions_[i], states.back()))
      return fails(task_->actions()[actions_[i]].name + " is not possible");
    states.push_back(task_->Apply(actions_[i], states.back()));
  }
  if (!(goal_ ? Accepts(states) : task_->IsGoal(states.back()))) return fails("the goal is not reached");
  return {};
}

std::vector<symbolic::Fact> Monitor::Facts(double time,
                                           const IndexedVector<ObjectId, control::MovingPose>& objects,
                                           ObjectId held) {
  observer_.Look(time, objects, held, true);
  std::vector<symbolic::Fact> facts;
  const auto is_observable = [&](const symbolic::Fact& fact) {
    return std::any_of(observer_.facts().begin(), observer_.facts().end(), [&](const ObservableFact& one) {
      return one.fact.predicate == fact.predicate && one.fact.arguments == fact.arguments;
    });
  };
  const auto add = [&](symbolic::Fact fact) {
    if (!is_observable(fact)) facts.push_back(std::move(fact));
  };
  for (size_t atom = 0; atom < task_->atoms().size(); ++atom) {
    const symbolic::Atom& one = task_->atoms()[atom];
    if (!task_->IsDerived(static_cast<int>(atom)) && ltl::IsTrue(state_, static_cast<int>(atom)))
      add({one.predicate, one.arguments, {}});
  }
  // What never changes is left out of the task's atoms.
  for (const symbolic::Fact& fact : task_->problem().init) {
    if (task_->FindAtom({fact.predicate, fact.arguments}) < 0) add(fact);
  }
  for (size_t i = 0; i < beliefs_.size(); ++i) {
    const ObservableFact& fact = observer_.facts()[i];
    if (beliefs_[i].trusted ? fact.seen : Believed(i)) facts.push_back(fact.fact);
  }
  return facts;
}

}  // namespace tether::execution
