#include <algorithm>
#include <iterator>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "tether/symbolic/grounding/instantiate.h"
#include "tether/symbolic/grounding/join.h"
#include "tether/symbolic/grounding/task.h"

namespace tether::symbolic {
namespace {

/// An action or axiom with its variables bound, over provisional atom numbers.
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

/// Predicates that some action changes or a rule derives.
std::set<int> FindChanged(const Domain& domain) {
  std::set<int> changed;
  for (const Action& action : domain.actions) CollectChanged(action.effect, changed);
  for (const DerivedRule& rule : domain.derived) changed.insert(rule.predicate);
  return changed;
}

/// The facts of all other predicates.
FactIndex MakeStaticFacts(const Problem& problem, const std::set<int>& changed) {
  std::vector<bool> known(problem.domain->predicates.size(), true);
  for (int predicate : changed) known[predicate] = false;
  FactIndex facts(problem, std::move(known));
  for (const Fact& fact : problem.init) facts.Add({fact.predicate, fact.arguments});
  return facts;
}

bool IsStatic(const Formula& formula, const std::set<int>& changed) {
  if (formula.kind == Formula::Kind::kAtom && changed.count(formula.predicate)) return false;
  return std::all_of(formula.children.begin(), formula.children.end(),
                     [&](const Formula& child) { return IsStatic(child, changed); });
}

/// Those of the first `parameters` variables that occur.
void CollectVariables(const Formula& formula, size_t parameters, std::set<int>& variables) {
  for (const Term& term : formula.terms) {
    if (term.is_variable && static_cast<size_t>(term.index) < parameters) variables.insert(term.index);
  }
  for (const Formula& child : formula.children) CollectVariables(child, parameters, variables);
}

void CollectConjuncts(const Formula& formula, std::vector<const Formula*>& conjuncts) {
  if (formula.kind != Formula::Kind::kAnd) {
    conjuncts.push_back(&formula);
    return;
  }
  for (const Formula& child : formula.children) CollectConjuncts(child, conjuncts);
}

}  // namespace

/// Finds the facts that may ever hold and the actions that may ever apply in the delete relaxation, fact by
/// fact: each new fact is joined with the others that an action or axiom needs.
class Grounder {
 public:
  Grounder(std::shared_ptr<const Problem> problem, const Limits& limits)
      : problem_(std::move(problem)),
        domain_(*problem_->domain),
        limits_(limits),
        changed_(FindChanged(domain_)),
        static_facts_(MakeStaticFacts(*problem_, changed_)),
        instantiator_(*problem_, limits, static_facts_,
                      [this](const Atom& atom) { return Provisional(atom); }),
        join_(*problem_, table_, instantiator_) {
    for (const Fact& fact : problem_->init) {
      const int number = Number({fact.predicate, fact.arguments});
      if (initial_[number]) continue;
      initial_[number] = true;
      may_fail_[number] = false;
      if (changed_.count(fact.predicate)) {
        MayHold(number);
      } else {
        may_hold_[number] = true;
        join_.AddFact(number);
      }
    }
    for (const Action& action : domain_.actions) AddRule(action.parameters, action.precondition);
    for (const DerivedRule& rule : domain_.derived) AddRule(rule.parameters, rule.body);
    for (const FunctionValue& value : problem_->values) {
      values_[{value.function, value.arguments}] = value.millionths;
    }
  }

  std::shared_ptr<const Task> Run() {
    for (size_t i = 0; i < rules_.size(); ++i) {
      const bool waits =
          std::any_of(rules_[i].patterns.begin(), rules_[i].patterns.end(),
                      [&](const auto& pattern) { return changed_.count(pattern.predicate) > 0; });
      if (!waits) join_.Match(rules_[i], [&](std::vector<int>& binding) { AddDraft(i, binding); });
    }
    Reach();
    return Finish();
  }

 private:
  void AddRule(const std::vector<TypedName>& parameters, const Formula& condition) {
    JoinRule rule;
    rule.parameters = &parameters;
    std::vector<const Formula*> conjuncts;
    CollectConjuncts(condition, conjuncts);
    for (const Formula* conjunct : conjuncts) {
      if (conjunct->kind == Formula::Kind::kAtom) {
        if (changed_.count(conjunct->predicate)) {
          triggers_[conjunct->predicate].push_back({rules_.size(), static_cast<int>(rule.patterns.size())});
        }
        rule.patterns.push_back({conjunct->predicate, conjunct->terms});
      } else if (IsStatic(*conjunct, changed_)) {
        std::set<int> variables;
        CollectVariables(*conjunct, parameters.size(), variables);
        rule.tests.push_back({conjunct, {variables.begin(), variables.end()}});
      }
    }
    rules_.push_back(std::move(rule));
  }

  GroundFormula Provisional(const Atom& atom) {
    if (!changed_.count(atom.predicate)) {
      const int number = table_.Find(atom);
      return GroundFormula::Constant(number >= 0 && initial_[number]);
    }
    return GroundFormula::Literal(Number(atom), true);
  }

  int Number(const Atom& atom) {
    const int number = table_.Number(atom);
    if (static_cast<size_t>(number) == initial_.size()) {
      initial_.push_back(false);
      may_hold_.push_back(false);
      may_fail_.push_back(true);
    }
    return number;
  }

  void MayHold(int atom) {
    if (may_hold_[atom]) return;
    may_hold_[atom] = true;
    queue_.push_back(atom);
  }

  void MayFail(int atom) {
    if (may_fail_[atom]) return;
    may_fail_[atom] = true;
    more_may_fail_ = true;
  }

  void AddDraft(size_t rule, std::vector<int>& binding) {
    Draft draft;
    const size_t actions = domain_.actions.size();
    if (rule >= actions) {
      const DerivedRule& derived = domain_.derived[rule - actions];
      draft.precondition = instantiator_.Instantiate(derived.body, binding);
      if (draft.precondition.is_false()) return;
      draft.schema = static_cast<int>(rule);
      draft.arguments = binding;
      draft.effects.push_back({GroundFormula{}, {}, {Number({derived.predicate, binding})}});
    } else {
      const Action& action = domain_.actions[rule];
      draft.schema = static_cast<int>(rule);
      draft.arguments = binding;
      draft.precondition = instantiator_.Instantiate(action.precondition, binding);
      if (draft.precondition.is_false()) return;
      AddEffect(action.effect, binding, GroundFormula{}, draft.effects);
    }
    drafts_.push_back(std::move(draft));
    waiting_.push_back(drafts_.size() - 1);
    if (!Fire(drafts_.size() - 1)) waiting_.pop_back();
  }

  void AddEffect(const Effect& effect, std::vector<int>& binding, const GroundFormula& condition,
                 std::vector<Draft::Effect>& effects) {
    switch (effect.kind) {
      case Effect::Kind::kAdd:
      case Effect::Kind::kDelete: {
        const int atom = Number(Instantiator::Bind(effect.predicate, effect.terms, binding));
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
        AddUniversal(effect.variables, effect.children[0], binding, condition, effects);
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

  /// `effect` for all objects: where it is conditional, for those for which the condition may hold.
  void AddUniversal(const std::vector<TypedName>& variables, const Effect& effect, std::vector<int>& binding,
                    const GroundFormula& condition, std::vector<Draft::Effect>& effects) {
    if (effect.kind == Effect::Kind::kAnd) {
      for (const Effect& child : effect.children) AddUniversal(variables, child, binding, condition, effects);
    } else if (effect.kind == Effect::Kind::kForall) {
      std::vector<TypedName> all = variables;
      all.insert(all.end(), effect.variables.begin(), effect.variables.end());
      AddUniversal(all, effect.children[0], binding, condition, effects);
    } else if (effect.kind == Effect::Kind::kWhen) {
      instantiator_.ForEachMatch(variables, effect.condition, true, binding, [&](std::vector<int>& bound) {
        AddEffect(effect, bound, condition, effects);
        return true;
      });
    } else {
      instantiator_.ForEach(variables, binding, [&] {
        AddEffect(effect, binding, condition, effects);
        return true;
      });
    }
  }

  bool MayBe(const GroundFormula& formula) const {
    auto may = [&](const GroundFormula& child) { return MayBe(child); };
    switch (formula.kind) {
      case GroundFormula::Kind::kTrue:
        return true;
      case GroundFormula::Kind::kFalse:
        return false;
      case GroundFormula::Kind::kLiteral:
        return (formula.positive ? may_hold_ : may_fail_)[formula.atom];
      case GroundFormula::Kind::kAnd:
        return std::all_of(formula.children.begin(), formula.children.end(), may);
      case GroundFormula::Kind::kOr:
        return std::any_of(formula.children.begin(), formula.children.end(), may);
    }
    return false;
  }

  /// Adds the effects that a draft may have by now; false if it can have no others.
  bool Fire(size_t index) {
    instantiator_.CountStep();
    Draft& draft = drafts_[index];
    if (!draft.reached && !MayBe(draft.precondition)) return true;
    draft.reached = true;
    bool all = true;
    for (const Draft::Effect& effect : draft.effects) {
      if (!MayBe(effect.condition)) {
        all = false;
        continue;
      }
      for (int atom : effect.adds) MayHold(atom);
      for (int atom : effect.deletes) MayFail(atom);
    }
    return !all;
  }

  void Reach() {
    do {
      // Facts are added to the join one by one, so that each binding is found with the last of its facts.
      for (; next_ < queue_.size(); ++next_) {
        const int fact = queue_[next_];
        join_.AddFact(fact);
        const auto triggers = triggers_.find(table_.atom(fact).predicate);
        if (triggers == triggers_.end()) continue;
        for (const auto& [rule, pattern] : triggers->second) {
          join_.Match(rules_[rule], pattern, fact,
                      [&, rule = rule](std::vector<int>& binding) { AddDraft(rule, binding); });
        }
      }
      more_may_fail_ = false;
      std::erase_if(waiting_, [&](size_t index) { return !Fire(index); });
    } while (next_ < queue_.size() || more_may_fail_);
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
      if (final_[atom] >= 0) numbers.push_back(final_[atom]);
    }
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
    return numbers;
  }

  std::shared_ptr<const Task> Finish() {
    std::shared_ptr<Task> task(new Task());
    task->problem_ = problem_;
    std::vector<int> order(may_hold_.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
    std::sort(order.begin(), order.end(), [&](int a, int b) { return table_.atom(a) < table_.atom(b); });
    final_.assign(may_hold_.size(), -1);
    for (int number : order) {
      const auto i = static_cast<size_t>(number);
      const Atom& atom = table_.atom(number);
      if (may_hold_[i] && may_fail_[i] && changed_.count(atom.predicate)) {
        final_[i] = static_cast<int>(task->atoms_.size());
        task->atoms_.push_back(atom);
      } else if (may_hold_[i]) {
        task->constant_atoms_.push_back(atom);
      }
    }
    task->initial_state_.assign(std::max<size_t>(1, (task->atoms_.size() + 63) / 64), 0);
    for (size_t i = 0; i < final_.size(); ++i) {
      if (final_[i] < 0 || !initial_[i]) continue;
      const auto atom = static_cast<size_t>(final_[i]);
      task->initial_state_[atom / 64] |= uint64_t{1} << (atom % 64);
    }
    std::sort(drafts_.begin(), drafts_.end(), [](const Draft& a, const Draft& b) {
      return std::tie(a.schema, a.arguments) < std::tie(b.schema, b.arguments);
    });
    for (const Draft& draft : drafts_) {
      instantiator_.CountStep();
      if (!draft.reached) continue;
      if (static_cast<size_t>(draft.schema) < domain_.actions.size()) {
        AddAction(draft, *task);
      } else {
        AddAxiom(draft, *task);
      }
    }
    SetCosts(*task);
    task->IndexActions();
    if (!task->derived_.empty()) task->Derive(task->initial_state_);
    task->goal_ = task->Compile(problem_->goal, limits_);
    return task;
  }

  void AddAxiom(const Draft& draft, Task& task) const {
    const int head = draft.effects.front().adds.front();
    const int atom = final_[head];
    const auto stratum = static_cast<size_t>(domain_.strata[table_.atom(head).predicate]);
    if (task.axioms_.size() < stratum) task.axioms_.resize(stratum);
    task.axioms_[stratum - 1].push_back({atom, Condition(Renumber(draft.precondition))});
    task.derived_.resize(task.initial_state_.size(), 0);
    task.derived_[static_cast<size_t>(atom) / 64] |= uint64_t{1} << (atom % 64);
  }

  /// Costs as whole multiples of a unit that is as large as possible; 1 each if cost is not to be minimised.
  void SetCosts(Task& task) const {
    if (!problem_->minimize_cost) return;
    Diagnostics missing;
    int64_t unit = 0;
    for (GroundAction& action : task.actions_) {
      action.cost = 0;
      for (const CostTerm& term : domain_.actions[action.schema].cost) {
        action.cost += term.function < 0 ? term.millionths : ValueOf(term, action, missing);
      }
      unit = std::gcd(unit, action.cost);
    }
    missing.ThrowIfAny();
    if (unit == 0) return;
    for (GroundAction& action : task.actions_) action.cost /= unit;
    task.cost_unit_ = static_cast<double>(unit) / static_cast<double>(kMillion);
  }

  int64_t ValueOf(const CostTerm& term, const GroundAction& action, Diagnostics& missing) const {
    const Atom call = Instantiator::Bind(term.function, term.terms, action.arguments);
    const auto it = values_.find(call);
    if (it != values_.end()) return it->second;
    std::string text = "(" + domain_.functions[term.function].name;
    for (int argument : call.arguments) text += " " + problem_->objects[argument].name;
    if (missing.list().size() < 10) {
      missing.Add(term.where, "the cost of " + action.name + " needs the value of " + text + ")",
                  "give it in ':init': (= " + text + ") number)");
    }
    return 0;
  }

  void AddAction(const Draft& draft, Task& task) const {
    GroundAction action;
    action.schema = draft.schema;
    action.arguments = draft.arguments;
    action.name = domain_.actions[draft.schema].name + "(";
    for (size_t i = 0; i < draft.arguments.size(); ++i) {
      action.name += (i > 0 ? "," : "") + problem_->objects[draft.arguments[i]].name;
    }
    action.name += ")";
    action.precondition = Condition(Renumber(draft.precondition));
    for (const Draft::Effect& effect : draft.effects) {
      GroundEffect ground{Condition(Renumber(effect.condition)), Renumber(effect.deletes),
                          Renumber(effect.adds)};
      if (ground.condition.never() || (ground.adds.empty() && ground.deletes.empty())) continue;
      action.effects.push_back(std::move(ground));
    }
    task.AddAction(std::move(action));
  }

  std::shared_ptr<const Problem> problem_;
  const Domain& domain_;
  const Limits& limits_;
  std::set<int> changed_;  ///< Predicates that some action changes or a rule derives.
  FactIndex static_facts_;
  AtomTable table_;
  std::vector<bool> initial_, may_hold_, may_fail_;  ///< By number in table_.
  Instantiator instantiator_;
  Join join_;
  std::vector<JoinRule> rules_;  ///< Of the actions, then of the derived predicates.
  std::map<int, std::vector<std::pair<size_t, int>>> triggers_;  ///< By predicate: rule and pattern.
  std::map<Atom, int64_t> values_;                               ///< Of functions.
  std::vector<int> queue_;  ///< Atoms that may hold and change, in the order found.
  size_t next_ = 0;         ///< The first of them that is not in join_.
  bool more_may_fail_ = false;
  std::vector<Draft> drafts_;
  std::vector<size_t> waiting_;  ///< Drafts that may have further effects once more facts may hold or fail.
  std::vector<int> final_;       ///< Number in the task by provisional number; -1 if the atom can't change.
};

std::shared_ptr<const Task> Task::Ground(std::shared_ptr<const Problem> problem, const Limits& limits) {
  return Grounder(std::move(problem), limits).Run();
}

}  // namespace tether::symbolic
