#include "tether/task/heuristics/merge.h"

#include <algorithm>
#include <set>

namespace tether::task {

using symbolic::Literal;
using symbolic::Variable;

bool Contains(const std::vector<int>& list, int item) {
  return std::find(list.begin(), list.end(), item) != list.end();
}

bool Asks(const symbolic::GroundAction& action, const Variable& variable) {
  const std::vector<int> literals = symbolic::NecessaryLiterals(action.precondition);
  return std::any_of(literals.begin(), literals.end(),
                     [&](int literal) { return Contains(variable.atoms, literal / 2); });
}

bool Changes(const symbolic::GroundEffect& effect, const Variable& variable) {
  return std::any_of(variable.atoms.begin(), variable.atoms.end(),
                     [&](int atom) { return Contains(effect.adds, atom) || Contains(effect.deletes, atom); });
}

bool Changes(const symbolic::GroundAction& action, const Variable& variable) {
  return std::any_of(action.effects.begin(), action.effects.end(),
                     [&](const symbolic::GroundEffect& effect) { return Changes(effect, variable); });
}

size_t FindValue(const Variable& variable, symbolic::StateView state) {
  for (size_t i = 0; i < variable.atoms.size(); ++i) {
    if (ltl::IsTrue(state, variable.atoms[i])) return i;
  }
  return variable.atoms.size();
}

std::optional<size_t> ValueAfter(const Variable& variable, const symbolic::GroundAction& action,
                                 size_t value) {
  std::optional<size_t> after;
  bool ends = false;
  for (const symbolic::GroundEffect& effect : action.effects) {
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

std::vector<bool> FindPossible(const Variable& variable, const symbolic::Mutexes& mutexes,
                               const std::vector<int>& literals) {
  std::vector<bool> possible(CountValues(variable), true);
  for (size_t i = 0; i < possible.size(); ++i) {
    const bool none = i == variable.atoms.size();
    possible[i] = std::none_of(literals.begin(), literals.end(), [&](int literal) {
      return none ? literal % 2 == 0 && Contains(variable.atoms, literal / 2)
                  : mutexes.AreMutex(Literal(variable.atoms[i], true), literal);
    });
  }
  return possible;
}

void AppendLiterals(const Variable& variable, size_t value, std::vector<int>& literals) {
  for (size_t i = 0; i < variable.atoms.size(); ++i)
    literals.push_back(Literal(variable.atoms[i], i == value));
}

std::optional<Tracking> Tracking::Make(const Product& product, int part, const Variable& variable,
                                       const std::optional<Merge>& merge, const symbolic::Mutexes& mutexes) {
  const ltl::LazyAutomaton& whole = *product.automaton();
  const ltl::Automaton* automaton = whole.PartAutomaton(part);
  if (automaton == nullptr) return std::nullopt;
  std::set<int> propositions;
  for (int state = 0; state < automaton->states(); ++state) {
    for (int atom : automaton->RelevantAtoms(state)) propositions.insert(atom);
  }
  const size_t own_values = CountValues(variable);
  std::vector<ltl::Letter> letters(own_values, ltl::Letter(whole.letter_words(), 0));
  for (size_t value = 0; value < own_values; ++value) {
    const bool none = value == variable.atoms.size();
    const int own = none ? -1 : Literal(variable.atoms[value], true);
    for (int proposition : propositions) {
      const int atom = product.propositions()[proposition];
      bool holds = atom == Propositions::kAlways;
      if (atom >= 0) {
        holds = !none && (own == Literal(atom, true) || mutexes.AreMutex(own, Literal(atom, false)));
        const bool fails = none ? Contains(variable.atoms, atom) : mutexes.AreMutex(own, Literal(atom, true));
        if (!holds && !fails) return std::nullopt;
      }
      if (holds) letters[value][static_cast<size_t>(proposition) / 64] |= uint64_t{1} << (proposition % 64);
    }
  }
  for (const symbolic::GroundAction& action : product.task().actions()) {
    for (const symbolic::GroundEffect& effect : action.effects) {
      if (!effect.condition.always() && Changes(effect, variable)) return std::nullopt;
    }
  }
  Tracking tracking;
  tracking.part_ = part;
  tracking.variable_ = variable;
  for (size_t value = 0; value < own_values; ++value) tracking.base_.push_back(value);
  if (merge) {
    tracking.implied_.assign(merge->values(), -1);
    for (size_t pair = 0; pair < merge->values(); ++pair) {
      std::vector<int> literals;
      AppendLiterals(merge->first, merge->First(pair), literals);
      AppendLiterals(merge->second, merge->Second(pair), literals);
      const std::vector<bool> possible = FindPossible(variable, mutexes, literals);
      if (std::count(possible.begin(), possible.end(), true) != 1) continue;
      tracking.implied_[pair] = static_cast<int>(tracking.base_.size());
      tracking.base_.push_back(
          static_cast<size_t>(std::find(possible.begin(), possible.end(), true) - possible.begin()));
    }
  }
  const auto states = static_cast<size_t>(automaton->states());
  tracking.next_.assign(states * tracking.values(), -1);
  tracking.possible_.assign(states * tracking.values(), false);
  for (size_t value = 0; value < tracking.values(); ++value) {
    for (size_t state = 0; state < states; ++state) {
      const int next = automaton->Step(static_cast<int>(state), letters[tracking.Base(value)]);
      if (automaton->IsTrap(next)) continue;
      tracking.next_[tracking.Entry(state, value)] = next;
      tracking.possible_[tracking.Entry(next, value)] = true;
    }
  }
  return tracking;
}

std::optional<size_t> Tracking::ImpliedBy(int pair) const {
  if (pair < 0 || implied_.empty() || implied_[pair] < 0) return std::nullopt;
  return static_cast<size_t>(implied_[pair]);
}

std::optional<size_t> Tracking::After(size_t state, size_t value) const {
  const int next = next_[Entry(state, value)];
  if (next < 0) return std::nullopt;
  return Entry(next, value);
}

size_t Tracking::Find(const Product& product, const Merge* merge, symbolic::StateView state) const {
  const int own = product.automaton()->PartState(product.AutomatonState(state), part_);
  const auto implied = ImpliedBy(merge == nullptr ? -1 : static_cast<int>(merge->Find(state)));
  return Entry(own, implied ? *implied : FindValue(variable_, state));
}

}  // namespace tether::task
