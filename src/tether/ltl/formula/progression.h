#pragma once

#include <cstddef>
#include <vector>

#include "tether/ltl/automaton/bdd.h"
#include "tether/ltl/formula/core.h"

namespace tether::ltl {

/// Formula progression (Bacchus and Kabanza, 2000) on canonical states.
///
/// A state says what the rest of the word must satisfy. It is a Boolean function of obligations (atoms,
/// X[!] f and f U g, at the next position) and of `end`, "there is no next position", as a decision diagram:
/// states that are equal as Boolean functions are one, so there are finitely many. `f U g` unfolds to g | f &
/// !end & (f U g), X[!] f to !end & f. One diagram manager holds both sides of a transition: first the atoms
/// at the current position, then `end`, then the obligations.
class Progression {
 public:
  using State = Bdd::Ref;

  /// Diagrams larger than `max_nodes` throw Bdd::TooLarge.
  explicit Progression(const Core& core, size_t max_nodes = SIZE_MAX);

  /// The state before the first letter.
  State Initial(Core::Ref formula);
  /// Whether a word that leads to `state` may end there.
  bool IsAccepting(State state) const;

  /// The next state as a function of the atoms: a diagram whose part below the atoms' levels is a state.
  Bdd::Ref Transition(State state);
  /// The next state under one letter; builds nothing that this letter does not need.
  State Step(State state, LetterView letter);

  /// The atoms that the next step may depend on, in increasing order (a superset).
  std::vector<int> RelevantAtoms(State state) const;
  /// A lower bound on the letters until acceptance, from Core's structure only (see the source). kNever for
  /// the false state.
  int LowerBound(State state) const;
  static constexpr int kNever = 0x3fffffff;

  const Bdd& bdd() const { return bdd_; }
  /// The level of atom a is a; states begin at this one.
  int first_state_level() const { return end_level_; }

 private:
  /// A memo that is cleared in constant time.
  struct Memo {
    std::vector<Bdd::Ref> value;
    std::vector<uint32_t> stamp;
    uint32_t now = 1;

    bool Has(size_t i) const { return i < stamp.size() && stamp[i] == now; }
    void Set(size_t i, Bdd::Ref ref);
  };

  int LevelOf(size_t core_node) const { return obligation_level_[core_node]; }
  /// What must hold at the next position for `f` to hold there, given that there is one.
  Bdd::Ref Obligation(Core::Ref f);
  /// `f` at the current position; of the atoms if `letter` is null.
  Bdd::Ref Progress(Core::Ref f, const LetterView* letter, Memo& memo);
  /// Replaces the obligations of a state, which has a next position, by what they become.
  Bdd::Ref Substitute(Bdd::Ref state, const LetterView* letter, Memo& states, Memo& progress);
  Bdd::Ref WithNextPosition(State state) const;
  /// Appends to needed_.
  void CountLettersNeeded(const Core::Node& node);
  size_t CoreNodeOf(Bdd::Ref state) const {
    return node_of_level_[static_cast<size_t>(bdd_.Level(state) - end_level_ - 1)];
  }

  const Core& core_;
  Bdd bdd_;
  int end_level_;
  Bdd::Ref not_end_;
  std::vector<int> obligation_level_;  ///< Per node of the core; -1 for true and conjunctions.
  std::vector<size_t> node_of_level_;  ///< Per level after `end`.
  std::vector<std::vector<int>> atoms_now_;
  std::vector<int> needed_[2];  ///< Letters that a word needs at least to satisfy a node, by sign.
  Memo obligation_memo_;
  Memo symbolic_states_, symbolic_progress_;
  Memo letter_states_, letter_progress_;
};

}  // namespace tether::ltl
