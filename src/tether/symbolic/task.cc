#include "tether/symbolic/task.h"

#include <algorithm>
#include <utility>

#include "tether/symbolic/instantiate.h"

namespace tether::symbolic {

void Task::Apply(int action, StateView state, std::span<uint64_t> next) const {
  const auto index = static_cast<size_t>(action);
  const std::vector<Change>& changes = changes_[index];
  std::copy(state.begin(), state.end(), next.begin());
  auto fires = [&](size_t i) {
    return !changes[i].conditional || actions_[index].effects[i].condition.Holds(state);
  };
  for (size_t i = 0; i < changes.size(); ++i) {
    if (!fires(i)) continue;
    for (const WordChange& change : changes[i].words) next[change.word] &= ~change.deletes;
  }
  for (size_t i = 0; i < changes.size(); ++i) {
    if (!fires(i)) continue;
    for (const WordChange& change : changes[i].words) next[change.word] |= change.adds;
  }
}

State Task::Apply(int action, const State& state) const {
  State next(state.size());
  Apply(action, state, next);
  return next;
}

int Task::FindAction(std::string_view name) const {
  const auto it = action_index_.find(name);
  return it == action_index_.end() ? -1 : it->second;
}

int Task::FindAtom(const Atom& atom) const {
  const auto it = atom_index_.find(atom);
  return it == atom_index_.end() ? -1 : it->second;
}

bool Task::HoldsAlways(const Atom& atom) const {
  return std::binary_search(constant_atoms_.begin(), constant_atoms_.end(), atom);
}

bool Task::Holds(const Atom& atom, StateView state) const {
  const int index = FindAtom(atom);
  if (index < 0) return HoldsAlways(atom);
  return (state[static_cast<size_t>(index) / 64] >> (index % 64) & 1) != 0;
}

Condition Task::Compile(const Formula& formula) const {
  Instantiator instantiator(*problem_, [this](const Atom& atom) {
    const int index = FindAtom(atom);
    return index >= 0 ? GroundFormula::Literal(index, true) : GroundFormula::Constant(HoldsAlways(atom));
  });
  std::vector<int> binding;
  return Condition(instantiator.Instantiate(formula, binding));
}

std::string Task::AtomName(const Atom& atom) const {
  std::string name = domain().predicates[static_cast<size_t>(atom.predicate)].name + "(";
  for (size_t i = 0; i < atom.arguments.size(); ++i) {
    if (i > 0) name += ",";
    name += problem_->objects[static_cast<size_t>(atom.arguments[i])].name;
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
