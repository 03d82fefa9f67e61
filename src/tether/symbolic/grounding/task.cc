#include "tether/symbolic/grounding/task.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "tether/symbolic/grounding/instantiate.h"

namespace tether::symbolic {

void Task::Apply(ActionId action, StateView state, std::span<uint64_t> next) const {
  const std::vector<Change>& changes = changes_[action];
  std::copy(state.begin(), state.end(), next.begin());
  auto fires = [&](size_t i) {
    return !changes[i].conditional || actions_[action].effects[i].condition.Holds(state);
  };
  for (size_t i = 0; i < changes.size(); ++i) {
    if (!fires(i)) continue;
    for (const WordChange& change : changes[i].words) next[change.word] &= ~change.deletes;
  }
  for (size_t i = 0; i < changes.size(); ++i) {
    if (!fires(i)) continue;
    for (const WordChange& change : changes[i].words) next[change.word] |= change.adds;
  }
  if (!derived_.empty()) Derive(next);
}

void Task::Derive(std::span<uint64_t> state) const {
  for (size_t word = 0; word < state.size(); ++word) state[word] &= ~derived_[word];
  for (const std::vector<GroundAxiom>& stratum : axioms_) {
    for (bool changed = true; changed;) {
      changed = false;
      for (const GroundAxiom& axiom : stratum) {
        uint64_t& word = state[static_cast<size_t>(axiom.atom) / 64];
        const uint64_t bit = uint64_t{1} << (axiom.atom % 64);
        if ((word & bit) != 0 || !axiom.body.Holds(state)) continue;
        word |= bit;
        changed = true;
      }
    }
  }
}

void Task::FindApplicable(StateView state, std::vector<ActionId>& actions) const {
  actions.clear();
  auto collect = [&](size_t list) {
    for (size_t i = first_watcher_[list]; i < first_watcher_[list + 1]; ++i) {
      if (IsApplicable(watchers_[i], state)) actions.push_back(watchers_[i]);
    }
  };
  for (size_t word = 0; word < words(); ++word) {
    for (uint64_t bits = state[word]; bits != 0; bits &= bits - 1) {
      collect(word * 64 + static_cast<size_t>(std::countr_zero(bits)));
    }
  }
  collect(atoms_.size());
  std::sort(actions.begin(), actions.end());
}

void Task::AddAction(GroundAction action) {
  std::vector<Change> changes;
  for (const GroundEffect& effect : action.effects) {
    Change change;
    change.conditional = !effect.condition.always();
    auto word_of = [&](int atom) -> WordChange& {
      const size_t word = static_cast<size_t>(atom) / 64;
      for (WordChange& existing : change.words) {
        if (existing.word == word) return existing;
      }
      return change.words.emplace_back(WordChange{word, 0, 0});
    };
    for (int atom : effect.deletes) word_of(atom).deletes |= uint64_t{1} << (atom % 64);
    for (int atom : effect.adds) word_of(atom).adds |= uint64_t{1} << (atom % 64);
    changes.push_back(std::move(change));
  }
  action_index_.emplace(action.name, actions_.next_id());
  actions_.push_back(std::move(action));
  changes_.push_back(std::move(changes));
}

void Task::IndexActions() {
  auto for_each_needed = [](const Condition& condition, const auto& visit) {
    const GroundFormula& formula = condition.formula();
    auto visit_literal = [&](const GroundFormula& f) {
      if (f.kind == GroundFormula::Kind::kLiteral && f.positive) visit(f.atom);
    };
    visit_literal(formula);
    if (formula.kind != GroundFormula::Kind::kAnd) return;
    for (const GroundFormula& child : formula.children) visit_literal(child);
  };
  // Actions are filed under the rarest of the atoms that they need.
  std::vector<int> users(atoms_.size(), 0);
  for (const GroundAction& action : actions_) {
    for_each_needed(action.precondition, [&](int atom) { ++users[atom]; });
  }
  IndexedVector<ActionId, size_t> list(actions_.size(), atoms_.size());
  first_watcher_.assign(atoms_.size() + 2, 0);
  for (const ActionId i : actions_.ids()) {
    for_each_needed(actions_[i].precondition, [&](int needed) {
      const auto atom = static_cast<size_t>(needed);
      if (list[i] == atoms_.size() || users[atom] < users[list[i]]) list[i] = atom;
    });
    ++first_watcher_[list[i] + 1];
  }
  for (size_t i = 1; i < first_watcher_.size(); ++i) first_watcher_[i] += first_watcher_[i - 1];
  std::vector<size_t> fill = first_watcher_;
  watchers_.resize(actions_.size());
  for (const ActionId i : actions_.ids()) watchers_[fill[list[i]]++] = i;
}

State Task::Apply(ActionId action, const State& state) const {
  State next(state.size());
  Apply(action, state, next);
  return next;
}

ActionId Task::FindAction(std::string_view name) const {
  const auto it = action_index_.find(name);
  return it == action_index_.end() ? ActionId() : it->second;
}

int Task::FindAtom(const Atom& atom) const {
  const auto it = std::lower_bound(atoms_.begin(), atoms_.end(), atom);
  return it != atoms_.end() && *it == atom ? static_cast<int>(it - atoms_.begin()) : -1;
}

bool Task::HoldsAlways(const Atom& atom) const {
  return std::binary_search(constant_atoms_.begin(), constant_atoms_.end(), atom);
}

bool Task::Holds(const Atom& atom, StateView state) const {
  const int index = FindAtom(atom);
  if (index < 0) return HoldsAlways(atom);
  return (state[static_cast<size_t>(index) / 64] >> (index % 64) & 1) != 0;
}

Condition Task::Compile(const Formula& formula, const Limits& limits) const {
  FactIndex facts(*problem_, std::vector<bool>(domain().predicates.size(), true));
  for (const Atom& atom : atoms_) facts.Add(atom);
  for (const Atom& atom : constant_atoms_) facts.Add(atom);
  Instantiator instantiator(*problem_, limits, facts, [this](const Atom& atom) {
    const int index = FindAtom(atom);
    return index >= 0 ? GroundFormula::Literal(index, true) : GroundFormula::Constant(HoldsAlways(atom));
  });
  std::vector<int> binding;
  return Condition(instantiator.Instantiate(formula, binding));
}

std::string Task::AtomName(const Atom& atom) const {
  std::string name = domain().predicates[atom.predicate].name + "(";
  for (size_t i = 0; i < atom.arguments.size(); ++i) {
    if (i > 0) name += ",";
    name += problem_->objects[atom.arguments[i]].name;
  }
  return name + ")";
}

std::vector<std::string> Task::TrueAtoms(StateView state, bool with_constant) const {
  std::vector<Atom> held;
  if (with_constant) held = constant_atoms_;
  for (size_t i = 0; i < atoms_.size(); ++i) {
    if ((state[i / 64] >> (i % 64) & 1) != 0) held.push_back(atoms_[i]);
  }
  std::sort(held.begin(), held.end());
  std::vector<std::string> names;
  for (const Atom& atom : held) names.push_back(AtomName(atom));
  return names;
}

}  // namespace tether::symbolic
