#include "tether/task/heuristics/relaxation.h"

#include "tether/common/limits.h"

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

}  // namespace

Relaxation::Relaxation(const Product& product, bool unit_costs) : product_(product) { Build(unit_costs); }

Relaxation::Relaxation(const Product& product, bool unit_costs, std::optional<Merge> merge,
                       std::vector<Tracking> trackings, const symbolic::Mutexes& mutexes)
    : product_(product), merge_(std::move(merge)), trackings_(std::move(trackings)), mutexes_(&mutexes) {
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
    if (atom >= 0) is_negated_[atom] = true;
  }

  AddFact();  // kTrue
  for (size_t i = 0; i < task.atoms().size(); ++i) {
    positive_.push_back(AddFact());
    const bool ask = is_negated_[i] && !task.IsDerived(static_cast<int>(i));
    negative_.push_back(ask ? AddFact() : -1);
  }
  goal_ = AddFact();
  AddActions();
  for (const Payer& payer : payers_) costs_.push_back(unit_costs ? 1 : task.actions()[payer.action].cost);
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
    is_negated_[formula.atom] = true;
  }
  for (const GroundFormula& child : formula.children) NoteNegated(child);
}

void Relaxation::AddOperator(int payer, std::vector<int> preconditions, std::vector<int> adds) {
  PollLimits();
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

void Relaxation::AddPairs() {
  if (merge_) {
    possible_.assign(merge_->values(), 0);
    merged_facts_.assign(merge_->values(), -1);
    for (size_t a = 0; a < CountValues(merge_->first); ++a) {
      std::vector<int> literals;
      if (a < merge_->first.atoms.size()) literals.push_back(symbolic::Literal(merge_->first.atoms[a], true));
      const std::vector<bool> beside = FindPossible(merge_->second, *mutexes_, literals);
      for (size_t b = 0; b < beside.size(); ++b) {
        if (!beside[b]) continue;
        possible_[merge_->Pair(a, b)] = 1;
        merged_facts_[merge_->Pair(a, b)] = AddFact();
      }
    }
  }
  for (const Tracking& tracking : trackings_) {
    std::vector<int>& facts = tracked_facts_.emplace_back(tracking.entries(), -1);
    for (size_t entry = 0; entry < facts.size(); ++entry) {
      if (tracking.IsPossible(entry)) facts[entry] = AddFact();
    }
  }
}

void Relaxation::AddActions() {
  AddPairs();
  const symbolic::Task& task = product_.task();
  std::vector<Context> contexts;
  for (const ActionId id : task.actions().ids()) {
    const symbolic::GroundAction& action = task.actions()[id];
    contexts.assign(1, {{id, -1, -1}, {}, {}, {}});
    if (product_.IsForbidden(id) || !Require(action.precondition.formula(), contexts.front().needed)) {
      payers_.push_back(contexts.front().payer);
      continue;
    }
    contexts.front().literals = symbolic::NecessaryLiterals(action.precondition);
    SplitByMerge(contexts);
    for (size_t k = 0; k < trackings_.size(); ++k) SplitByTracking(k, contexts);
    for (const Context& context : contexts) AddAction(context);
  }
}

void Relaxation::AddAction(const Context& context) {
  const symbolic::GroundAction& action = product_.task().actions()[context.payer.action];
  const int own = static_cast<int>(payers_.size());
  payers_.push_back(context.payer);
  auto add_facts = [&](const symbolic::GroundEffect& effect, std::vector<int>& adds) {
    for (int atom : effect.adds) adds.push_back(positive_[atom]);
    for (int atom : effect.deletes) {
      if (negative_[atom] >= 0) adds.push_back(negative_[atom]);
    }
  };
  std::vector<int> always = context.made;
  for (const symbolic::GroundEffect& effect : action.effects) {
    if (effect.condition.always()) {
      add_facts(effect, always);
      continue;
    }
    std::vector<int> conditions = context.needed, adds;
    if (!Require(effect.condition.formula(), conditions)) continue;
    add_facts(effect, adds);
    AddOperator(own, std::move(conditions), std::move(adds));
  }
  AddOperator(own, context.needed, std::move(always));
}

/// Drops facts that a pair implies.
void Relaxation::DropFacts(const symbolic::Variable& variable, std::vector<int>& facts) const {
  for (int atom : variable.atoms) {
    std::erase(facts, positive_[atom]);
    if (negative_[atom] >= 0) std::erase(facts, negative_[atom]);
  }
}

/// The action once for each pair of values at which it may be applicable.
void Relaxation::SplitByMerge(std::vector<Context>& contexts) const {
  if (!merge_) return;
  const ActionId index = contexts.front().payer.action;
  const symbolic::GroundAction& action = product_.task().actions()[index];
  const bool changes = Changes(action, merge_->first) || Changes(action, merge_->second);
  if (!changes && !(Asks(action, merge_->first) && Asks(action, merge_->second))) return;
  std::vector<Context> split;
  for (const Context& context : contexts) {
    const std::vector<bool> first = FindPossible(merge_->first, *mutexes_, context.literals);
    const std::vector<bool> second = FindPossible(merge_->second, *mutexes_, context.literals);
    for (size_t from = 0; from < merge_->values(); ++from) {
      const size_t a = merge_->First(from), b = merge_->Second(from);
      if (!first[a] || !second[b] || IsImpossible(from)) continue;
      const auto a_after = ValueAfter(merge_->first, action, a),
                 b_after = ValueAfter(merge_->second, action, b);
      if (!a_after || !b_after) continue;
      const size_t to = merge_->Pair(*a_after, *b_after);
      if (IsImpossible(to)) continue;
      Context& own = split.emplace_back(context);
      own.payer = {index, static_cast<int>(from), static_cast<int>(to)};
      DropFacts(merge_->first, own.needed);
      DropFacts(merge_->second, own.needed);
      own.needed.push_back(merged_facts_[from]);
      if (from != to) own.made.push_back(merged_facts_[to]);
      AppendLiterals(merge_->first, a, own.literals);
      AppendLiterals(merge_->second, b, own.literals);
    }
  }
  contexts = std::move(split);
}

/// The same for each state of the part and each value of what it tracks, if the action changes that.
void Relaxation::SplitByTracking(size_t index, std::vector<Context>& contexts) const {
  const Tracking& tracking = trackings_[index];
  const std::vector<int>& facts = tracked_facts_[index];
  std::vector<Context> split;
  for (Context& context : contexts) {
    const symbolic::GroundAction& action = product_.task().actions()[context.payer.action];
    const auto implied = tracking.ImpliedBy(context.payer.from),
               implied_after = tracking.ImpliedBy(context.payer.to);
    if (!Changes(action, tracking.variable()) && implied == implied_after) {
      split.push_back(std::move(context));
      continue;
    }
    const std::vector<bool> possible = FindPossible(tracking.variable(), *mutexes_, context.literals);
    for (size_t value = 0; value < tracking.values(); ++value) {
      const size_t base = tracking.Base(value);
      if (!possible[base]) continue;
      // A known pair determines the value.
      if (context.payer.from >= 0 && (implied ? value != *implied : tracking.IsImplied(value))) continue;
      const auto base_after = ValueAfter(tracking.variable(), action, base);
      if (!base_after) continue;
      size_t after = *base_after;
      if (implied_after) {
        if (tracking.Base(*implied_after) != after) continue;
        after = *implied_after;
      } else if (context.payer.from < 0 && tracking.IsImplied(value)) {
        // The pair stays, so what it implies does.
        if (after != base) continue;
        after = value;
      }
      for (size_t state = 0; state < tracking.entries() / tracking.values(); ++state) {
        const size_t from = tracking.Entry(state, value);
        const auto to = tracking.After(state, after);
        if (!tracking.IsPossible(from) || !to) continue;
        Context& own = split.emplace_back(context);
        DropFacts(tracking.variable(), own.needed);
        own.needed.push_back(facts[from]);
        if (*to != from) own.made.push_back(facts[*to]);
        AppendLiterals(tracking.variable(), base, own.literals);
      }
    }
  }
  contexts = std::move(split);
}

void Relaxation::AddAxioms() {
  for (const auto& stratum : product_.task().axioms()) {
    for (const symbolic::GroundAxiom& axiom : stratum) {
      std::vector<int> needed;
      if (!Require(axiom.body.formula(), needed)) continue;
      AddOperator(kFree, std::move(needed), {positive_[axiom.atom]});
    }
  }
}

bool Relaxation::RequireProposition(int proposition, bool positive, std::vector<int>& preconditions) {
  const int atom = product_.propositions()[proposition];
  if (atom < 0) return (atom == Propositions::kAlways) == positive;
  const int fact = (positive ? positive_ : negative_)[atom];
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
    const auto tracking = std::find_if(trackings_.begin(), trackings_.end(),
                                       [&](const Tracking& one) { return one.part() == part; });
    if (tracking != trackings_.end()) {
      all_accept.push_back(AddTracked(*tracking, tracked_facts_[tracking - trackings_.begin()]));
      continue;
    }
    std::vector<int>& states = part_facts_.back();
    const int accepts = AddFact();
    all_accept.push_back(accepts);
    for (int state = 0; state < automaton->states(); ++state) {
      states.push_back(AddFact());
      if (automaton->IsAccepting(state)) AddOperator(kFree, {states.back()}, {accepts});
    }
    for (const ltl::AutomatonEdge& edge : automaton->Edges(ltl::GuardForms::kShort)) {
      if (edge.from == edge.to || automaton->IsTrap(edge.to)) continue;
      const int from = states[edge.from], to = states[edge.to];
      if (!edge.has_guard && !edge.has_clauses) {  // No precondition, which is a relaxation too.
        AddOperator(kFree, {from}, {to});
        continue;
      }
      // Clause by clause: the needs of each clause are a landmark of their own; a choice between cubes is
      // weaker.
      const bool many_clauses = edge.clauses.size() > edge.guard.size() + kManyClauses;
      if (!edge.has_clauses || (edge.has_guard && (edge.guard.size() == 1 || many_clauses))) {
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

/// The transitions of a part under other actions, and its acceptance.
int Relaxation::AddTracked(const Tracking& tracking, const std::vector<int>& facts) {
  const ltl::Automaton& automaton = *product_.automaton()->PartAutomaton(tracking.part());
  const int accepts = AddFact();
  for (size_t entry = 0; entry < tracking.entries(); ++entry) {
    if (!tracking.IsPossible(entry)) continue;
    if (automaton.IsAccepting(static_cast<int>(tracking.State(entry))))
      AddOperator(kFree, {facts[entry]}, {accepts});
    const auto after = tracking.After(tracking.State(entry), tracking.Value(entry));
    if (after && *after != entry) AddOperator(kFree, {facts[entry]}, {facts[*after]});
  }
  return accepts;
}

void Relaxation::KeepRelevant() {
  std::vector<std::vector<int>> adders(facts_);
  for (size_t i = 0; i < operators_.size(); ++i) {
    for (int fact : operators_[i].adds) adders[fact].push_back(static_cast<int>(i));
  }
  std::vector<bool> relevant(facts_, false), kept(operators_.size(), false);
  std::vector<int> queue = {goal_};
  relevant[goal_] = true;
  for (size_t i = 0; i < queue.size(); ++i) {
    for (int adder : adders[queue[i]]) {
      if (kept[adder]) continue;
      kept[adder] = true;
      for (int fact : operators_[adder].preconditions) {
        if (relevant[fact]) continue;
        relevant[fact] = true;
        queue.push_back(fact);
      }
    }
  }
  std::vector<int> renumbered(facts_, -1);
  facts_ = 0;
  for (size_t i = 0; i < relevant.size(); ++i) {
    if (relevant[i] || static_cast<int>(i) == kTrue) renumbered[i] = facts_++;
  }
  auto renumber = [&](std::vector<int>& list) {
    for (int& fact : list) fact = fact < 0 ? -1 : renumbered[fact];
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
  for (std::vector<int>& own : tracked_facts_) renumber(own);
  for (std::vector<int>& states : part_facts_) renumber(states);
  goal_ = renumbered[goal_];
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
  for (size_t i = 0; i < trackings_.size(); ++i) {
    const int fact = tracked_facts_[i][trackings_[i].Find(product_, merge(), state)];
    if (fact >= 0) facts.push_back(fact);
  }
  for (size_t part = 0; part < part_facts_.size(); ++part) {
    if (part_facts_[part].empty()) continue;
    const int own = product_.automaton()->PartState(product_.AutomatonState(state), static_cast<int>(part));
    const int fact = part_facts_[part][own];
    if (fact >= 0) facts.push_back(fact);
  }
}

}  // namespace tether::task
