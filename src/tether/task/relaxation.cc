#include "tether/task/relaxation.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace tether::task {
namespace {

using symbolic::GroundFormula;

constexpr size_t kManyClauses = 16;

void SortUnique(std::vector<int>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

size_t FindValue(const symbolic::Variable& variable, symbolic::StateView state) {
  for (size_t i = 0; i < variable.atoms.size(); ++i) {
    const auto atom = static_cast<size_t>(variable.atoms[i]);
    if ((state[atom / 64] >> (atom % 64) & 1) != 0) return i;
  }
  return variable.atoms.size();
}

}  // namespace

size_t Merge::Find(symbolic::StateView state) const {
  return FindValue(first, state) * second_values() + FindValue(second, state);
}

Relaxation::Relaxation(const Product& product, bool unit_costs) : product_(product) { Build(unit_costs); }

Relaxation::Relaxation(const Product& product, bool unit_costs, const Merge& merge,
                       const symbolic::Mutexes& mutexes)
    : product_(product), merge_(merge), mutexes_(&mutexes) {
  Build(unit_costs);
}

void Relaxation::Build(bool unit_costs) {
  const symbolic::Task& task = product_.task();
  is_negated_.assign(task.atoms().size(), false);
  for (const symbolic::GroundAction& action : task.actions()) {
    NoteNegated(action.precondition.formula());
    for (const symbolic::GroundEffect& effect : action.effects) NoteNegated(effect.condition.formula());
  }
  for (const auto& stratum : task.axioms()) {
    for (const symbolic::GroundAxiom& axiom : stratum) NoteNegated(axiom.body.formula());
  }
  if (product_.automaton() == nullptr) NoteNegated(task.goal().formula());
  for (int atom : product_.propositions()) {
    if (atom >= 0) is_negated_[static_cast<size_t>(atom)] = true;
  }

  AddFact();  // kTrue
  for (size_t i = 0; i < task.atoms().size(); ++i) {
    positive_.push_back(AddFact());
    const bool ask = is_negated_[i] && !task.IsDerived(static_cast<int>(i));
    negative_.push_back(ask ? AddFact() : -1);
  }
  goal_ = AddFact();
  AddActions();
  for (const Payer& payer : payers_)
    costs_.push_back(unit_costs ? 1 : task.actions()[static_cast<size_t>(payer.action)].cost);
  costs_.push_back(0);
  AddAxioms();
  if (product_.automaton() != nullptr) {
    AddAutomaton();
  } else {
    std::vector<int> needed;
    if (Require(task.goal().formula(), needed)) AddOperator(kFree, std::move(needed), {goal_});
  }
  KeepRelevant();
  for (Operator& op : operators_) {
    if (op.payer == kFree) op.payer = static_cast<int>(payers_.size());
  }
}

void Relaxation::NoteNegated(const GroundFormula& formula) {
  if (formula.kind == GroundFormula::Kind::kLiteral && !formula.positive) {
    is_negated_[static_cast<size_t>(formula.atom)] = true;
  }
  for (const GroundFormula& child : formula.children) NoteNegated(child);
}

void Relaxation::AddOperator(int payer, std::vector<int> preconditions, std::vector<int> adds) {
  SortUnique(preconditions);
  SortUnique(adds);
  if (adds.empty()) return;
  if (preconditions.empty()) preconditions.push_back(kTrue);
  operators_.push_back({payer, std::move(preconditions), std::move(adds)});
}

bool Relaxation::Require(const GroundFormula& formula, std::vector<int>& preconditions) {
  switch (formula.kind) {
    case GroundFormula::Kind::kTrue:
      return true;
    case GroundFormula::Kind::kFalse:
      return false;
    case GroundFormula::Kind::kLiteral: {
      const auto atom = static_cast<size_t>(formula.atom);
      const int fact = formula.positive ? positive_[atom] : negative_[atom];
      if (fact >= 0) preconditions.push_back(fact);
      return true;
    }
    case GroundFormula::Kind::kAnd:
      return std::all_of(formula.children.begin(), formula.children.end(),
                         [&](const GroundFormula& child) { return Require(child, preconditions); });
    case GroundFormula::Kind::kOr: {
      const int either = AddFact();
      for (const GroundFormula& child : formula.children) {
        std::vector<int> needed;
        if (Require(child, needed)) AddOperator(kFree, std::move(needed), {either});
      }
      preconditions.push_back(either);
      return true;
    }
  }
  return false;
}

void Relaxation::AddActions() {
  const symbolic::Task& task = product_.task();
  if (merge_) {
    const size_t count = merge_->second_values();
    possible_.assign(merge_->values(), 0);
    merged_facts_.assign(merge_->values(), -1);
    for (size_t i = 0; i < merge_->first_values(); ++i) {
      std::vector<int> holds;
      if (i < merge_->first.atoms.size()) holds.push_back(symbolic::Literal(merge_->first.atoms[i], true));
      const std::vector<bool> beside = FindPossible(merge_->second, count, holds);
      for (size_t k = 0; k < count; ++k) {
        possible_[i * count + k] = beside[k] ? 1 : 0;
        if (beside[k]) merged_facts_[i * count + k] = AddFact();
      }
    }
  }
  for (size_t i = 0; i < task.actions().size(); ++i) {
    const symbolic::GroundAction& action = task.actions()[i];
    const int index = static_cast<int>(i);
    std::vector<int> needed;
    if (product_.IsForbidden(index) || !Require(action.precondition.formula(), needed)) {
      payers_.push_back({index, -1, -1});
    } else if (merge_ && DependsOnMerge(action)) {
      AddMerged(index, needed);
    } else {
      AddAction(index, needed, {index, -1, -1});
    }
  }
}

/// `needed` are the facts of the precondition.
void Relaxation::AddAction(int index, const std::vector<int>& needed, Payer payer) {
  const symbolic::GroundAction& action = product_.task().actions()[static_cast<size_t>(index)];
  const int own = static_cast<int>(payers_.size());
  payers_.push_back(payer);
  auto add_facts = [&](const symbolic::GroundEffect& effect, std::vector<int>& adds) {
    for (int atom : effect.adds) adds.push_back(positive_[static_cast<size_t>(atom)]);
    for (int atom : effect.deletes) {
      if (negative_[static_cast<size_t>(atom)] >= 0) adds.push_back(negative_[static_cast<size_t>(atom)]);
    }
  };
  std::vector<int> always;
  if (payer.to != payer.from) always.push_back(merged_facts_[static_cast<size_t>(payer.to)]);
  for (const symbolic::GroundEffect& effect : action.effects) {
    if (effect.condition.always()) {
      add_facts(effect, always);
      continue;
    }
    std::vector<int> conditions = needed, adds;
    if (!Require(effect.condition.formula(), conditions)) continue;
    add_facts(effect, adds);
    AddOperator(own, std::move(conditions), std::move(adds));
  }
  AddOperator(own, needed, std::move(always));
}

namespace {

bool Contains(const std::vector<int>& list, int item) {
  return std::find(list.begin(), list.end(), item) != list.end();
}

/// The value of `variable` after `action`, from `value` on; none if that can't be.
std::optional<size_t> ValueAfter(const symbolic::Variable& variable, const symbolic::GroundAction& action,
                                 size_t value) {
  std::optional<size_t> after;
  bool ends = false;
  for (const symbolic::GroundEffect& effect : action.effects) {
    if (!effect.condition.always()) continue;
    for (size_t i = 0; i < variable.atoms.size(); ++i) {
      if (Contains(effect.adds, variable.atoms[i])) {
        if (after && *after != i) return std::nullopt;
        after = i;
      }
      ends = ends || (i == value && Contains(effect.deletes, variable.atoms[i]));
    }
  }
  if (after) return after;
  if (!ends) return value;
  if (variable.exactly_one) return std::nullopt;
  return variable.atoms.size();
}

}  // namespace

/// By value, whether it may hold together with `literals`.
std::vector<bool> Relaxation::FindPossible(const symbolic::Variable& variable, size_t values,
                                           const std::vector<int>& literals) const {
  std::vector<bool> possible(values, true);
  for (size_t i = 0; i < values; ++i) {
    const bool none = i == variable.atoms.size();
    possible[i] = std::none_of(literals.begin(), literals.end(), [&](int literal) {
      return none ? literal % 2 == 0 && Contains(variable.atoms, literal / 2)
                  : mutexes_->AreMutex(symbolic::Literal(variable.atoms[i], true), literal);
    });
  }
  return possible;
}

bool Relaxation::DependsOnMerge(const symbolic::GroundAction& action) const {
  const auto speaks_of = [&](const symbolic::Variable& variable) {
    const std::vector<int> literals = symbolic::NecessaryLiterals(action.precondition);
    return std::any_of(literals.begin(), literals.end(),
                       [&](int literal) { return Contains(variable.atoms, literal / 2); });
  };
  const auto changes = [&](const symbolic::Variable& variable) {
    return std::any_of(action.effects.begin(), action.effects.end(), [&](const auto& effect) {
      return std::any_of(variable.atoms.begin(), variable.atoms.end(), [&](int atom) {
        return Contains(effect.adds, atom) || Contains(effect.deletes, atom);
      });
    });
  };
  return changes(merge_->first) || changes(merge_->second) ||
         (speaks_of(merge_->first) && speaks_of(merge_->second));
}

/// The action once for each pair of values that its precondition allows.
void Relaxation::AddMerged(int index, const std::vector<int>& needed) {
  const symbolic::GroundAction& action = product_.task().actions()[static_cast<size_t>(index)];
  const std::vector<int> literals = symbolic::NecessaryLiterals(action.precondition);
  const size_t count = merge_->second_values();
  const std::vector<bool> first = FindPossible(merge_->first, merge_->first_values(), literals);
  const std::vector<bool> second = FindPossible(merge_->second, count, literals);
  // The pair says all that the literals about its variables say.
  std::vector<int> others = needed;
  for (const symbolic::Variable* variable : {&merge_->first, &merge_->second}) {
    for (int atom : variable->atoms) {
      std::erase(others, positive_[static_cast<size_t>(atom)]);
      if (negative_[static_cast<size_t>(atom)] >= 0) std::erase(others, negative_[static_cast<size_t>(atom)]);
    }
  }
  for (size_t i = 0; i < first.size(); ++i) {
    const auto first_after = ValueAfter(merge_->first, action, i);
    for (size_t k = 0; k < count; ++k) {
      const size_t from = i * count + k;
      if (!first[i] || !second[k] || !first_after || possible_[from] == 0) continue;
      const auto second_after = ValueAfter(merge_->second, action, k);
      if (!second_after) continue;
      const size_t to = *first_after * count + *second_after;
      if (possible_[to] == 0) continue;
      std::vector<int> preconditions = others;
      preconditions.push_back(merged_facts_[from]);
      AddAction(index, preconditions, {index, static_cast<int>(from), static_cast<int>(to)});
    }
  }
}

void Relaxation::AddAxioms() {
  for (const auto& stratum : product_.task().axioms()) {
    for (const symbolic::GroundAxiom& axiom : stratum) {
      std::vector<int> needed;
      if (!Require(axiom.body.formula(), needed)) continue;
      AddOperator(kFree, std::move(needed), {positive_[static_cast<size_t>(axiom.atom)]});
    }
  }
}

bool Relaxation::RequireProposition(int proposition, bool positive, std::vector<int>& preconditions) {
  const int atom = product_.propositions()[static_cast<size_t>(proposition)];
  if (atom < 0) return (atom == Propositions::kAlways) == positive;
  const int fact = (positive ? positive_ : negative_)[static_cast<size_t>(atom)];
  if (fact >= 0) preconditions.push_back(fact);
  return true;
}

void Relaxation::AddAutomaton() {
  const ltl::LazyAutomaton& whole = *product_.automaton();
  std::vector<int> all_accept;
  for (int part = 0; part < whole.parts(); ++part) {
    part_facts_.emplace_back();
    const ltl::Automaton* automaton = whole.PartAutomaton(part);
    if (automaton == nullptr) continue;
    std::vector<int>& states = part_facts_.back();
    const int accepts = AddFact();
    all_accept.push_back(accepts);
    for (int state = 0; state < automaton->states(); ++state) {
      states.push_back(AddFact());
      if (automaton->IsAccepting(state)) AddOperator(kFree, {states.back()}, {accepts});
    }
    for (const ltl::AutomatonEdge& edge : automaton->Edges()) {
      if (edge.from == edge.to || automaton->IsTrap(edge.to)) continue;
      const int from = states[static_cast<size_t>(edge.from)], to = states[static_cast<size_t>(edge.to)];
      // Clause by clause, what each asks for is a landmark of its own; a choice between cubes blurs that.
      if (edge.guard.size() == 1 || edge.clauses.size() > edge.guard.size() + kManyClauses) {
        for (const ltl::Cube& cube : edge.guard) {
          std::vector<int> needed = {from};
          const bool may = std::all_of(cube.literals.begin(), cube.literals.end(), [&](const auto& literal) {
            return RequireProposition(literal.first, literal.second, needed);
          });
          if (may) AddOperator(kFree, std::move(needed), {to});
        }
        continue;
      }
      std::vector<int> needed = {from};
      bool possible = true;
      for (const ltl::Cube& clause : edge.clauses) {
        if (clause.literals.size() == 1) {
          const auto& [proposition, positive] = clause.literals.front();
          possible = possible && RequireProposition(proposition, positive, needed);
          continue;
        }
        const int either = AddFact();
        needed.push_back(either);
        for (const auto& [proposition, positive] : clause.literals) {
          std::vector<int> one;
          if (RequireProposition(proposition, positive, one)) AddOperator(kFree, std::move(one), {either});
        }
      }
      if (possible) AddOperator(kFree, std::move(needed), {to});
    }
  }
  AddOperator(kFree, std::move(all_accept), {goal_});
}

void Relaxation::KeepRelevant() {
  std::vector<std::vector<int>> adders(static_cast<size_t>(facts_));
  for (size_t i = 0; i < operators_.size(); ++i) {
    for (int fact : operators_[i].adds) adders[static_cast<size_t>(fact)].push_back(static_cast<int>(i));
  }
  std::vector<bool> relevant(static_cast<size_t>(facts_), false), kept(operators_.size(), false);
  std::vector<int> queue = {goal_};
  relevant[static_cast<size_t>(goal_)] = true;
  for (size_t i = 0; i < queue.size(); ++i) {
    for (int adder : adders[static_cast<size_t>(queue[i])]) {
      if (kept[static_cast<size_t>(adder)]) continue;
      kept[static_cast<size_t>(adder)] = true;
      for (int fact : operators_[static_cast<size_t>(adder)].preconditions) {
        if (relevant[static_cast<size_t>(fact)]) continue;
        relevant[static_cast<size_t>(fact)] = true;
        queue.push_back(fact);
      }
    }
  }
  std::vector<int> renumbered(static_cast<size_t>(facts_), -1);
  facts_ = 0;
  for (size_t i = 0; i < relevant.size(); ++i) {
    if (relevant[i] || static_cast<int>(i) == kTrue) renumbered[i] = facts_++;
  }
  auto renumber = [&](std::vector<int>& list) {
    for (int& fact : list) fact = fact < 0 ? -1 : renumbered[static_cast<size_t>(fact)];
  };
  std::vector<Operator> operators;
  for (size_t i = 0; i < operators_.size(); ++i) {
    if (!kept[i]) continue;
    Operator& op = operators.emplace_back(std::move(operators_[i]));
    renumber(op.preconditions);
    renumber(op.adds);
    std::erase(op.adds, -1);
  }
  operators_ = std::move(operators);
  renumber(positive_);
  renumber(negative_);
  renumber(merged_facts_);
  for (std::vector<int>& states : part_facts_) renumber(states);
  goal_ = renumbered[static_cast<size_t>(goal_)];
}

void Relaxation::FindFacts(symbolic::StateView state, std::vector<int>& facts) const {
  facts.clear();
  facts.push_back(kTrue);
  for (size_t i = 0; i < positive_.size(); ++i) {
    const int fact = (state[i / 64] >> (i % 64) & 1) != 0 ? positive_[i] : negative_[i];
    if (fact >= 0) facts.push_back(fact);
  }
  if (merge_) {
    const int fact = merged_facts_[merge_->Find(state)];
    if (fact >= 0) facts.push_back(fact);
  }
  for (size_t part = 0; part < part_facts_.size(); ++part) {
    if (part_facts_[part].empty()) continue;
    const int own = product_.automaton()->PartState(product_.AutomatonState(state), static_cast<int>(part));
    const int fact = part_facts_[part][static_cast<size_t>(own)];
    if (fact >= 0) facts.push_back(fact);
  }
}

}  // namespace tether::task
