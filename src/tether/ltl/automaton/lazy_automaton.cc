#include "tether/ltl/automaton/lazy_automaton.h"

#include <algorithm>

namespace tether::ltl {

LazyAutomaton::LazyAutomaton(const Formula& formula, Semantics semantics, const LazyOptions& options)
    : atoms_(formula.atoms()),
      parts_(SplitIntoParts(formula, semantics, options.max_part_states, options.max_part_nodes)),
      slots_(64, -1),
      scratch_(parts_.size(), 0) {
  for (const auto& part : parts_) {
    if (part->LowerBound(0) == kNever) scratch_.assign(scratch_.size(), -1);
  }
  Intern();
}

int LazyAutomaton::Step(int state, LetterView letter) {
  const size_t first = static_cast<size_t>(state) * parts_.size();
  if (IsTrap(state)) return state;
  bool same = true;
  for (size_t k = 0; k < parts_.size(); ++k) {
    const int before = tuples_[first + k];
    const int after = parts_[k]->Step(before, letter);
    if (parts_[k]->LowerBound(after) == kNever) {
      scratch_.assign(scratch_.size(), -1);
      return Intern();
    }
    scratch_[k] = after;
    same = same && after == before;
  }
  return same ? state : Intern();
}

size_t LazyAutomaton::Probe(const int* tuple) const {
  uint64_t hash = 0;
  for (size_t k = 0; k < parts_.size(); ++k) {
    hash = (hash ^ static_cast<uint32_t>(tuple[k])) * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 32;
  }
  const size_t mask = slots_.size() - 1;
  size_t i = static_cast<size_t>(hash) & mask;
  while (slots_[i] >= 0 && !std::equal(tuple, tuple + parts_.size(),
                                       &tuples_[static_cast<size_t>(slots_[i]) * parts_.size()])) {
    i = (i + 1) & mask;
  }
  return i;
}

int LazyAutomaton::Intern() {
  int& slot = slots_[Probe(scratch_.data())];
  if (slot >= 0) return slot;
  const int state = slot = states();
  AddState();
  if (2 * info_.size() > slots_.size()) Grow();
  return state;
}

void LazyAutomaton::AddState() {
  tuples_.insert(tuples_.end(), scratch_.begin(), scratch_.end());
  Info info{0, true, true, relevant_.size(), 0};
  if (scratch_.front() < 0) {
    info_.push_back({kNever, false, false, relevant_.size(), 0});
    return;
  }
  for (size_t k = 0; k < parts_.size(); ++k) {
    const AutomatonPart& part = *parts_[k];
    info.bound = std::max(info.bound, part.LowerBound(scratch_[k]));
    info.accepting = info.accepting && part.IsAccepting(scratch_[k]);
    info.settled = info.settled && part.IsSettled(scratch_[k]);
    const std::vector<int>& atoms = part.RelevantAtoms(scratch_[k]);
    relevant_.insert(relevant_.end(), atoms.begin(), atoms.end());
  }
  const auto begin = relevant_.begin() + static_cast<ptrdiff_t>(info.first_atom);
  std::sort(begin, relevant_.end());
  relevant_.erase(std::unique(begin, relevant_.end()), relevant_.end());
  info.atom_count = relevant_.size() - info.first_atom;
  info_.push_back(info);
}

void LazyAutomaton::Grow() {
  slots_.assign(2 * slots_.size(), -1);
  for (int s = 0; s < states(); ++s) slots_[Probe(&tuples_[static_cast<size_t>(s) * parts_.size()])] = s;
}

}  // namespace tether::ltl
