#include "tether/ltl/formula/progression.h"

#include <algorithm>
#include <cassert>
#include <iterator>

namespace tether::ltl {
namespace {

std::vector<int> Union(const std::vector<int>& a, const std::vector<int>& b) {
  std::vector<int> both;
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(both));
  return both;
}

}  // namespace

void Progression::Memo::Set(size_t i, Bdd::Ref ref) {
  if (i >= value.size()) {
    value.resize(std::max(i + 1, 2 * value.size()));
    stamp.resize(value.size());
  }
  value[i] = ref;
  stamp[i] = now;
}

Progression::Progression(const Core& core, size_t max_nodes)
    : core_(core), bdd_(max_nodes), end_level_(core.atoms()), not_end_(Bdd::Not(bdd_.Var(end_level_))) {
  using Kind = Core::Kind;
  std::vector<int> level_of_atom(core.atoms(), -1);
  int level = end_level_;
  for (const Core::Node& node : core.nodes()) {
    const bool literal = node.kind == Kind::kAtom || node.kind == Kind::kNegatedAtom;
    const size_t i = obligation_level_.size();
    if (node.kind == Kind::kTrue || node.kind == Kind::kAnd) {
      obligation_level_.push_back(-1);
    } else if (literal && level_of_atom[node.atom] >= 0) {
      obligation_level_.push_back(level_of_atom[node.atom]);
    } else {
      obligation_level_.push_back(++level);
      node_of_level_.push_back(i);
      if (literal) level_of_atom[node.atom] = level;
    }
    std::vector<int> now;
    if (literal) now = {node.atom};
    if (node.kind == Kind::kAnd || node.kind == Kind::kUntil) {
      now = Union(atoms_now_[node.left >> 1], atoms_now_[node.right >> 1]);
    }
    atoms_now_.push_back(std::move(now));
    CountLettersNeeded(node);
  }
}

void Progression::CountLettersNeeded(const Core::Node& node) {
  const auto needed = [&](Core::Ref f) { return needed_[f & 1][f >> 1]; };
  int plain = 1, negated = 1;
  switch (node.kind) {
    case Core::Kind::kTrue:
      plain = 0;
      negated = kNever;
      break;
    case Core::Kind::kAnd:
      plain = std::max(needed(node.left), needed(node.right));
      negated = std::min(needed(Core::Not(node.left)), needed(Core::Not(node.right)));
      break;
    case Core::Kind::kNext:
      plain = std::min(kNever, 1 + std::max(1, needed(node.left)));
      break;
    case Core::Kind::kUntil:
      plain = std::max(1, needed(node.right));
      negated = std::max(1, needed(Core::Not(node.right)));
      break;
    case Core::Kind::kAtom:
    case Core::Kind::kNegatedAtom:
      break;
  }
  needed_[0].push_back(plain);
  needed_[1].push_back(negated);
}

Bdd::Ref Progression::Obligation(Core::Ref f) {
  const size_t i = f >> 1;
  if (!obligation_memo_.Has(i)) {
    const Core::Node& node = core_.nodes()[i];
    Bdd::Ref ref = Bdd::kTrue;
    if (node.kind == Core::Kind::kAnd) {
      ref = bdd_.And(Obligation(node.left), Obligation(node.right));
    } else if (node.kind != Core::Kind::kTrue) {
      ref = bdd_.Var(LevelOf(i));
      if (node.kind == Core::Kind::kNegatedAtom) ref = Bdd::Not(ref);
    }
    obligation_memo_.Set(i, ref);
  }
  return obligation_memo_.value[i] ^ (f & 1);
}

Progression::State Progression::Initial(Core::Ref formula) {
  const Bdd::Ref on_end = core_.HoldsOnEmptyWord(formula) ? Bdd::kTrue : Bdd::kFalse;
  return bdd_.Ite(not_end_, Obligation(formula), on_end);
}

bool Progression::IsAccepting(State state) const {
  if (bdd_.Level(state) == end_level_) {
    assert(Bdd::IsConstant(bdd_.High(state)));
    return bdd_.High(state) == Bdd::kTrue;
  }
  assert(Bdd::IsConstant(state));
  return state == Bdd::kTrue;
}

Bdd::Ref Progression::WithNextPosition(State state) const {
  return bdd_.Level(state) == end_level_ ? bdd_.Low(state) : state;
}

Bdd::Ref Progression::Progress(Core::Ref f, const LetterView* letter, Memo& memo) {
  const size_t i = f >> 1;
  if (!memo.Has(i)) {
    const Core::Node& node = core_.nodes()[i];
    Bdd::Ref ref = Bdd::kTrue;
    switch (node.kind) {
      case Core::Kind::kTrue:
        break;
      case Core::Kind::kAtom:
      case Core::Kind::kNegatedAtom:
        if (letter == nullptr) {
          ref = bdd_.Var(node.atom);
        } else {
          ref = IsTrue(*letter, node.atom) ? Bdd::kTrue : Bdd::kFalse;
        }
        if (node.kind == Core::Kind::kNegatedAtom) ref = Bdd::Not(ref);
        break;
      case Core::Kind::kAnd:
        ref = bdd_.And(Progress(node.left, letter, memo), Progress(node.right, letter, memo));
        break;
      case Core::Kind::kNext:
        ref = bdd_.And(not_end_, Obligation(node.left));
        break;
      case Core::Kind::kUntil: {
        const Bdd::Ref again = bdd_.And(not_end_, bdd_.Var(LevelOf(i)));
        const Bdd::Ref now = Progress(node.right, letter, memo);
        ref = bdd_.Or(now, bdd_.And(Progress(node.left, letter, memo), again));
        break;
      }
    }
    memo.Set(i, ref);
  }
  return memo.value[i] ^ (f & 1);
}

Bdd::Ref Progression::Substitute(Bdd::Ref state, const LetterView* letter, Memo& states, Memo& progress) {
  if (Bdd::IsConstant(state)) return state;
  const size_t i = state >> 1;
  if (!states.Has(i)) {
    const Bdd::Ref plain = state & ~1u;
    const size_t core_node = CoreNodeOf(plain);
    Bdd::Ref test = Progress(static_cast<Core::Ref>(core_node << 1), letter, progress);
    if (core_.nodes()[core_node].kind == Core::Kind::kNegatedAtom) test = Bdd::Not(test);
    const Bdd::Ref low = bdd_.Low(plain), high = bdd_.High(plain);
    // A letter often decides the test; the other branch is then not evaluated.
    Bdd::Ref ref;
    if (test == Bdd::kTrue) {
      ref = Substitute(high, letter, states, progress);
    } else if (test == Bdd::kFalse) {
      ref = Substitute(low, letter, states, progress);
    } else {
      const Bdd::Ref if_true = Substitute(high, letter, states, progress);
      ref = bdd_.Ite(test, if_true, Substitute(low, letter, states, progress));
    }
    states.Set(i, ref);
  }
  return states.value[i] ^ (state & 1);
}

Bdd::Ref Progression::Transition(State state) {
  return Substitute(WithNextPosition(state), nullptr, symbolic_states_, symbolic_progress_);
}

Progression::State Progression::Step(State state, LetterView letter) {
  ++letter_states_.now;
  ++letter_progress_.now;
  return Substitute(WithNextPosition(state), &letter, letter_states_, letter_progress_);
}

std::vector<int> Progression::RelevantAtoms(State state) const {
  std::vector<int> atoms;
  std::vector<Bdd::Ref> open{WithNextPosition(state)};
  TripleMap seen;
  while (!open.empty()) {
    const Bdd::Ref next = open.back() & ~1u;
    open.pop_back();
    const auto fresh = static_cast<uint32_t>(seen.size());
    if (Bdd::IsConstant(next) || seen.FindOrInsert(next, 0, 0, fresh) != fresh) continue;
    atoms = Union(atoms, atoms_now_[CoreNodeOf(next)]);
    open.push_back(bdd_.Low(next));
    open.push_back(bdd_.High(next));
  }
  return atoms;
}

// When a word ends, each obligation was met or not; that is a path to true through the state. The word is at
// least as long as the most demanding obligation of this path needs, and the path is at best the least
// demanding one.
int Progression::LowerBound(State state) const {
  if (IsAccepting(state)) return 0;
  TripleMap known;
  const auto bound = [&](const auto& self, Bdd::Ref f) -> int {
    if (f == Bdd::kTrue) return 1;
    if (f == Bdd::kFalse) return kNever;
    const uint32_t cached = known.Find(f, 0, 0);
    if (cached != TripleMap::kNone) return static_cast<int>(cached);
    const size_t node = CoreNodeOf(f);
    const uint32_t negated = core_.nodes()[node].kind == Core::Kind::kNegatedAtom ? 1 : 0;
    const int high = std::max(needed_[negated][node], self(self, bdd_.High(f)));
    const int low = std::max(needed_[1 - negated][node], self(self, bdd_.Low(f)));
    return static_cast<int>(known.FindOrInsert(f, 0, 0, static_cast<uint32_t>(std::min(high, low))));
  };
  return bound(bound, WithNextPosition(state));
}

}  // namespace tether::ltl
