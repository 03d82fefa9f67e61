#include <algorithm>
#include <iterator>
#include <set>
#include <string>
#include <utility>

#include "tether/symbolic/instantiate.h"
#include "tether/symbolic/task.h"

namespace tether::symbolic {
namespace {

constexpr size_t kMaxActions = 1'000'000;

/// An action with its variables bound, over provisional atom numbers.
struct Draft {
  struct Effect {
    GroundFormula condition;
    std::vector<int> deletes;
    std::vector<int> adds;
  };
  int schema = -1;
  std::vector<int> arguments;
  GroundFormula precondition;
  std::vector<Effect> effects;
  bool reached = false;
};

void CollectChanged(const Effect& effect, std::set<int>& predicates) {
  if (effect.predicate >= 0) predicates.insert(effect.predicate);
  for (const Effect& child : effect.children) CollectChanged(child, predicates);
}

bool IsStatic(const Formula& formula, const std::set<int>& changed) {
  if (formula.kind == Formula::Kind::kAtom && changed.count(formula.predicate)) return false;
  return std::all_of(formula.children.begin(), formula.children.end(),
                     [&](const Formula& child) { return IsStatic(child, changed); });
}

/// One more than the highest of the first `parameters` variables that occur.
size_t BoundAt(const Formula& formula, size_t parameters) {
  size_t level = 0;
  for (const Term& term : formula.terms) {
    const auto index = static_cast<size_t>(term.index);
    if (term.is_variable && index < parameters) level = std::max(level, index + 1);
  }
  for (const Formula& child : formula.children) level = std::max(level, BoundAt(child, parameters));
  return level;
}

void CollectConjuncts(const Formula& formula, std::vector<const Formula*>& conjuncts) {
  if (formula.kind != Formula::Kind::kAnd) {
    conjuncts.push_back(&formula);
    return;
  }
  for (const Formula& child : formula.children) CollectConjuncts(child, conjuncts);
}

}  // namespace

class Grounder {
 public:
  explicit Grounder(std::shared_ptr<const Problem> problem)
      : problem_(std::move(problem)),
        domain_(*problem_->domain),
        instantiator_(*problem_, [this](const Atom& atom) { return Provisional(atom); }) {
    for (const Action& action : domain_.actions) CollectChanged(action.effect, changed_);
    for (const Fact& fact : problem_->init) {
      Atom atom{fact.predicate, fact.arguments};
      if (changed_.count(atom.predicate)) Number(atom, true);
      facts_.insert(std::move(atom));
    }
  }

  std::shared_ptr<const Task> Run() {
    for (size_t i = 0; i < domain_.actions.size(); ++i) DraftActions(static_cast<int>(i));
    Reach();
    return Finish();
  }

 private:
  GroundFormula Provisional(const Atom& atom) {
    if (!changed_.count(atom.predicate)) return GroundFormula::Constant(facts_.count(atom) > 0);
    return GroundFormula::Literal(Number(atom, false), true);
  }

  int Number(const Atom& atom, bool initially) {
    const auto [it, is_new] = numbers_.emplace(atom, static_cast<int>(may_hold_.size()));
    if (is_new) {
      may_hold_.push_back(initially);
      may_fail_.push_back(!initially);
    }
    return it->second;
  }

  void DraftActions(int schema) {
    const Action& action = domain_.actions[static_cast<size_t>(schema)];
    std::vector<const Formula*> conjuncts;
    CollectConjuncts(action.precondition, conjuncts);
    std::vector<std::vector<const Formula*>> checks(action.parameters.size() + 1);
    for (const Formula* conjunct : conjuncts) {
      if (IsStatic(*conjunct, changed_)) {
        checks[BoundAt(*conjunct, action.parameters.size())].push_back(conjunct);
      }
    }
    std::vector<int> binding;
    ChooseArguments(schema, action, checks, binding);
  }

  void ChooseArguments(int schema, const Action& action,
                       const std::vector<std::vector<const Formula*>>& checks, std::vector<int>& binding) {
    for (const Formula* check : checks[binding.size()]) {
      std::vector<int> extended = binding;
      extended.resize(action.parameters.size(),
                      -1);  // Quantified variables are numbered after all parameters.
      if (instantiator_.Instantiate(*check, extended).is_false()) return;
    }
    if (binding.size() == action.parameters.size()) {
      AddDraft(schema, action, binding);
      return;
    }
    for (int object : instantiator_.types().ObjectsOf(action.parameters[binding.size()].types)) {
      instantiator_.CountStep(action.where);
      binding.push_back(object);
      ChooseArguments(schema, action, checks, binding);
      binding.pop_back();
    }
  }

  void AddDraft(int schema, const Action& action, std::vector<int>& binding) {
    Draft draft;
    draft.schema = schema;
    draft.arguments = binding;
    draft.precondition = instantiator_.Instantiate(action.precondition, binding);
    if (draft.precondition.is_false()) return;
    AddEffect(action.effect, binding, GroundFormula{}, draft.effects);
    if (drafts_.size() >= kMaxActions) {
      throw InputError(
          {{action.where, "the problem has more than " + std::to_string(kMaxActions) + " ground actions",
            "use fewer objects, parameters or narrower types"}});
    }
    drafts_.push_back(std::move(draft));
  }

  void AddEffect(const Effect& effect, std::vector<int>& binding, const GroundFormula& condition,
                 std::vector<Draft::Effect>& effects) {
    switch (effect.kind) {
      case Effect::Kind::kAdd:
      case Effect::Kind::kDelete: {
        const int atom = Number(Instantiator::Bind(effect.predicate, effect.terms, binding), false);
        if (effects.empty()) effects.push_back({condition, {}, {}});
        Draft::Effect& target =
            effects.front();  // The first entry has `condition`; those of inner `when`s follow.
        (effect.kind == Effect::Kind::kAdd ? target.adds : target.deletes).push_back(atom);
        break;
      }
      case Effect::Kind::kAnd:
        for (const Effect& child : effect.children) AddEffect(child, binding, condition, effects);
        break;
      case Effect::Kind::kForall:
        instantiator_.ForEach(effect.variables, binding, effect.where, [&] {
          AddEffect(effect.children[0], binding, condition, effects);
          return true;
        });
        break;
      case Effect::Kind::kWhen: {
        GroundFormula own = instantiator_.Instantiate(effect.condition, binding);
        if (own.is_false()) break;
        std::vector<GroundFormula> both;
        both.push_back(condition);
        both.push_back(std::move(own));
        const GroundFormula joined = GroundFormula::Join(GroundFormula::Kind::kAnd, std::move(both));
        std::vector<Draft::Effect> inner;
        inner.push_back({joined, {}, {}});
        AddEffect(effect.children[0], binding, joined, inner);
        if (effects.empty()) effects.push_back({GroundFormula{}, {}, {}});
        if (joined.is_true()) {
          Draft::Effect& first = effects.front();
          first.adds.insert(first.adds.end(), inner[0].adds.begin(), inner[0].adds.end());
          first.deletes.insert(first.deletes.end(), inner[0].deletes.begin(), inner[0].deletes.end());
          inner.erase(inner.begin());
        }
        std::move(inner.begin(), inner.end(), std::back_inserter(effects));
        break;
      }
    }
  }

  bool MayHold(const GroundFormula& formula) const {
    auto may = [&](const GroundFormula& child) { return MayHold(child); };
    switch (formula.kind) {
      case GroundFormula::Kind::kTrue:
        return true;
      case GroundFormula::Kind::kFalse:
        return false;
      case GroundFormula::Kind::kLiteral:
        return (formula.positive ? may_hold_ : may_fail_)[static_cast<size_t>(formula.atom)];
      case GroundFormula::Kind::kAnd:
        return std::all_of(formula.children.begin(), formula.children.end(), may);
      case GroundFormula::Kind::kOr:
        return std::any_of(formula.children.begin(), formula.children.end(), may);
    }
    return false;
  }

  /// Which atoms may ever hold or fail, and which actions may ever apply, when effects only add
  /// possibilities.
  void Reach() {
    bool grew = true;
    auto mark = [&](std::vector<bool>& flags, int atom) {
      if (flags[static_cast<size_t>(atom)]) return;
      flags[static_cast<size_t>(atom)] = true;
      grew = true;
    };
    while (grew) {
      grew = false;
      for (Draft& draft : drafts_) {
        if (!draft.reached && !MayHold(draft.precondition)) continue;
        if (draft.reached && draft.effects.size() <= 1) continue;
        draft.reached = true;
        for (const Draft::Effect& effect : draft.effects) {
          if (!MayHold(effect.condition)) continue;
          for (int atom : effect.adds) mark(may_hold_, atom);
          for (int atom : effect.deletes) mark(may_fail_, atom);
        }
      }
    }
  }

  GroundFormula Renumber(const GroundFormula& formula) const {
    switch (formula.kind) {
      case GroundFormula::Kind::kLiteral: {
        const auto atom = static_cast<size_t>(formula.atom);
        if (final_[atom] >= 0) return GroundFormula::Literal(final_[atom], formula.positive);
        return GroundFormula::Constant(may_hold_[atom] == formula.positive);
      }
      case GroundFormula::Kind::kAnd:
      case GroundFormula::Kind::kOr: {
        std::vector<GroundFormula> children;
        for (const GroundFormula& child : formula.children) children.push_back(Renumber(child));
        return GroundFormula::Join(formula.kind, std::move(children));
      }
      default:
        return formula;
    }
  }

  std::vector<int> Renumber(const std::vector<int>& atoms) const {
    std::vector<int> numbers;
    for (int atom : atoms) {
      if (final_[static_cast<size_t>(atom)] >= 0) numbers.push_back(final_[static_cast<size_t>(atom)]);
    }
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
    return numbers;
  }

  std::shared_ptr<const Task> Finish() {
    std::shared_ptr<Task> task(new Task());
    task->problem_ = problem_;
    final_.assign(may_hold_.size(), -1);
    for (const auto& [atom, number] : numbers_) {
      const auto i = static_cast<size_t>(number);
      if (may_hold_[i] && may_fail_[i]) {
        final_[i] = static_cast<int>(task->atoms_.size());
        task->atom_index_.emplace(atom, final_[i]);
        task->atoms_.push_back(atom);
      } else if (may_hold_[i]) {
        task->constant_atoms_.push_back(atom);
      }
    }
    for (const Atom& atom : facts_) {
      if (!changed_.count(atom.predicate)) task->constant_atoms_.push_back(atom);
    }
    std::sort(task->constant_atoms_.begin(), task->constant_atoms_.end());
    task->initial_state_.assign(std::max<size_t>(1, (task->atoms_.size() + 63) / 64), 0);
    for (size_t i = 0; i < task->atoms_.size(); ++i) {
      if (facts_.count(task->atoms_[i])) task->initial_state_[i / 64] |= uint64_t{1} << (i % 64);
    }
    for (const Draft& draft : drafts_) {
      if (draft.reached) AddAction(draft, *task);
    }
    task->goal_ = task->Compile(problem_->goal);
    return task;
  }

  void AddAction(const Draft& draft, Task& task) const {
    GroundAction action;
    action.schema = draft.schema;
    action.arguments = draft.arguments;
    action.name = domain_.actions[static_cast<size_t>(draft.schema)].name + "(";
    for (size_t i = 0; i < draft.arguments.size(); ++i) {
      action.name += (i > 0 ? "," : "") + problem_->objects[static_cast<size_t>(draft.arguments[i])].name;
    }
    action.name += ")";
    action.precondition = Condition(Renumber(draft.precondition));
    std::vector<Task::Change> changes;
    for (const Draft::Effect& effect : draft.effects) {
      GroundEffect ground{Condition(Renumber(effect.condition)), Renumber(effect.deletes),
                          Renumber(effect.adds)};
      if (ground.condition.never() || (ground.adds.empty() && ground.deletes.empty())) continue;
      Task::Change change;
      change.conditional = !ground.condition.always();
      auto word_of = [&](int atom) -> Task::WordChange& {
        const size_t word = static_cast<size_t>(atom) / 64;
        for (Task::WordChange& existing : change.words) {
          if (existing.word == word) return existing;
        }
        return change.words.emplace_back(Task::WordChange{word, 0, 0});
      };
      for (int atom : ground.deletes) word_of(atom).deletes |= uint64_t{1} << (atom % 64);
      for (int atom : ground.adds) word_of(atom).adds |= uint64_t{1} << (atom % 64);
      changes.push_back(std::move(change));
      action.effects.push_back(std::move(ground));
    }
    task.action_index_.emplace(action.name, static_cast<int>(task.actions_.size()));
    task.actions_.push_back(std::move(action));
    task.changes_.push_back(std::move(changes));
  }

  std::shared_ptr<const Problem> problem_;
  const Domain& domain_;
  std::set<int> changed_;  ///< Predicates that some action changes.
  std::set<Atom> facts_;
  std::map<Atom, int> numbers_;
  std::vector<bool> may_hold_, may_fail_;  ///< By provisional number.
  Instantiator instantiator_;
  std::vector<Draft> drafts_;
  std::vector<int> final_;  ///< Number in the task by provisional number; -1 if the atom can't change.
};

std::shared_ptr<const Task> Task::Ground(std::shared_ptr<const Problem> problem) {
  return Grounder(std::move(problem)).Run();
}

}  // namespace tether::symbolic
