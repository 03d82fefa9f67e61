#include "tether/task/relaxation.h"

#include <algorithm>
#include <utility>

namespace tether::task {
namespace {

using symbolic::GroundFormula;

constexpr size_t kManyClauses = 16;

void SortUnique(std::vector<int>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

}  // namespace

Relaxation::Relaxation(const Product& product, bool unit_costs) : product_(product) {
  const symbolic::Task& task = product.task();
  for (const symbolic::GroundAction& action : task.actions()) costs_.push_back(unit_costs ? 1 : action.cost);
  free_ = static_cast<int>(costs_.size());
  costs_.push_back(0);

  is_negated_.assign(task.atoms().size(), false);
  for (const symbolic::GroundAction& action : task.actions()) {
    NoteNegated(action.precondition.formula());
    for (const symbolic::GroundEffect& effect : action.effects) NoteNegated(effect.condition.formula());
  }
  for (const auto& stratum : task.axioms()) {
    for (const symbolic::GroundAxiom& axiom : stratum) NoteNegated(axiom.body.formula());
  }
  if (product.automaton() == nullptr) NoteNegated(task.goal().formula());
  for (int atom : product.propositions()) {
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
  if (product.automaton() != nullptr) {
    AddAutomaton();
  } else {
    std::vector<int> needed;
    if (Require(task.goal().formula(), needed)) AddOperator(free_, std::move(needed), {goal_});
  }
  KeepRelevant();
}

void Relaxation::NoteNegated(const GroundFormula& formula) {
  if (formula.kind == GroundFormula::Kind::kLiteral && !formula.positive) {
    is_negated_[static_cast<size_t>(formula.atom)] = true;
  }
  for (const GroundFormula& child : formula.children) NoteNegated(child);
}

void Relaxation::AddOperator(int action, std::vector<int> preconditions, std::vector<int> adds) {
  SortUnique(preconditions);
  SortUnique(adds);
  if (adds.empty()) return;
  if (preconditions.empty()) preconditions.push_back(kTrue);
  operators_.push_back({action, std::move(preconditions), std::move(adds)});
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
        if (Require(child, needed)) AddOperator(free_, std::move(needed), {either});
      }
      preconditions.push_back(either);
      return true;
    }
  }
  return false;
}

void Relaxation::AddActions() {
  const symbolic::Task& task = product_.task();
  auto add_facts = [&](const symbolic::GroundEffect& effect, std::vector<int>& adds) {
    for (int atom : effect.adds) adds.push_back(positive_[static_cast<size_t>(atom)]);
    for (int atom : effect.deletes) {
      if (negative_[static_cast<size_t>(atom)] >= 0) adds.push_back(negative_[static_cast<size_t>(atom)]);
    }
  };
  for (size_t i = 0; i < task.actions().size(); ++i) {
    const symbolic::GroundAction& action = task.actions()[i];
    std::vector<int> needed;
    if (product_.IsForbidden(static_cast<int>(i))) continue;
    if (!Require(action.precondition.formula(), needed)) continue;
    std::vector<int> always;
    for (const symbolic::GroundEffect& effect : action.effects) {
      if (effect.condition.always()) {
        add_facts(effect, always);
        continue;
      }
      std::vector<int> conditions = needed, adds;
      if (!Require(effect.condition.formula(), conditions)) continue;
      add_facts(effect, adds);
      AddOperator(static_cast<int>(i), std::move(conditions), std::move(adds));
    }
    AddOperator(static_cast<int>(i), std::move(needed), std::move(always));
  }
  for (const auto& stratum : task.axioms()) {
    for (const symbolic::GroundAxiom& axiom : stratum) {
      std::vector<int> needed;
      if (!Require(axiom.body.formula(), needed)) continue;
      AddOperator(free_, std::move(needed), {positive_[static_cast<size_t>(axiom.atom)]});
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
      if (automaton->IsAccepting(state)) AddOperator(free_, {states.back()}, {accepts});
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
          if (may) AddOperator(free_, std::move(needed), {to});
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
          if (RequireProposition(proposition, positive, one)) AddOperator(free_, std::move(one), {either});
        }
      }
      if (possible) AddOperator(free_, std::move(needed), {to});
    }
  }
  AddOperator(free_, std::move(all_accept), {goal_});
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
  for (size_t part = 0; part < part_facts_.size(); ++part) {
    if (part_facts_[part].empty()) continue;
    const int own = product_.automaton()->PartState(product_.AutomatonState(state), static_cast<int>(part));
    const int fact = part_facts_[part][static_cast<size_t>(own)];
    if (fact >= 0) facts.push_back(fact);
  }
}

}  // namespace tether::task
