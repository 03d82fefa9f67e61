#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tether/ltl/automaton/automaton.h"
#include "tether/ltl/automaton/automaton_part.h"
#include "tether/ltl/formula/formula.h"

namespace tether::ltl {

struct LazyOptions {
  /// A part of the formula with more states or a larger diagram is progressed instead of compiled, and parts
  /// that share atoms are not multiplied out beyond this.
  size_t max_part_states = 1000;
  size_t max_part_nodes = 20'000;
};

/// The automaton of a formula for a search: states are created when the search steps into them.
///
/// The formula is split at its conjunctions. Conjuncts that share atoms are compiled together into one
/// minimal automaton as long as that stays small (so that their contradictions are known at once); others
/// stay apart, and a state is one state per part: n tasks `F(a & X F b)` are n automata with three states
/// each, and of their 3ⁿ combinations only those are built that the search visits.
///
/// A plan's word has one letter per state of the world, the first included: a search steps once from
/// initial() with the atoms of its first state, then once per action.
///
/// Steps add states: not for several threads at once.
class LazyAutomaton {
 public:
  static constexpr int kNever = Automaton::kNever;

  /// Throws InputError if `formula` can't be read with `semantics`.
  LazyAutomaton(const Formula& formula, Semantics semantics, const LazyOptions& options = {});

  /// In the order of their bits in a letter.
  const std::vector<std::string>& atoms() const { return atoms_; }
  /// 64-bit words of a letter.
  size_t letter_words() const { return LetterWords(atoms_.size()); }

  static constexpr int initial() { return 0; }
  /// The number of states so far; their numbers are below this.
  int states() const { return static_cast<int>(info_.size()); }

  /// The state after `letter`. Only RelevantAtoms(state) are read; other bits may be anything.
  int Step(int state, LetterView letter);
  /// The same for formulas with at most 64 atoms.
  int Step(int state, uint64_t letter) { return Step(state, LetterView(&letter, 1)); }

  bool IsAccepting(int state) const { return info_[static_cast<size_t>(state)].accepting; }
  /// Known to accept no continuation: a search can drop it. All such states are one.
  bool IsTrap(int state) const { return LowerBound(state) == kNever; }
  /// Known to accept every continuation.
  bool IsSettled(int state) const { return info_[static_cast<size_t>(state)].settled; }
  /// A lower bound on the letters until acceptance, 0 exactly where accepting: the largest of the parts'
  /// bounds, each exact for its part if that is compiled. Consistent: a step lowers it by 1 at most.
  int LowerBound(int state) const { return info_[static_cast<size_t>(state)].bound; }
  /// The atoms that a step from `state` may depend on, in increasing order. The span is valid until the next
  /// Step().
  std::span<const int> RelevantAtoms(int state) const {
    const Info& info = info_[static_cast<size_t>(state)];
    return {relevant_.data() + info.first_atom, info.atom_count};
  }

  /// The parts: a word is accepted if all accept it.
  int parts() const { return static_cast<int>(parts_.size()); }
  /// The minimal automaton of a part; null if it is progressed. Its letters are those of the whole.
  const Automaton* PartAutomaton(int part) const { return parts_[static_cast<size_t>(part)]->automaton(); }
  /// The state of a part. `state` is not a trap.
  int PartState(int state, int part) const {
    return tuples_[static_cast<size_t>(state) * parts_.size() + static_cast<size_t>(part)];
  }

 private:
  struct Info {
    int bound = 0;
    bool accepting = false;
    bool settled = false;
    size_t first_atom = 0;  ///< Relevant atoms: a range of relevant_.
    size_t atom_count = 0;
  };

  /// The number of the state whose parts are in scratch_.
  int Intern();
  void AddState();
  void Grow();
  size_t Probe(const int* tuple) const;

  std::vector<std::string> atoms_;
  std::vector<std::unique_ptr<AutomatonPart>> parts_;
  std::vector<Info> info_;
  std::vector<int> tuples_;  ///< States of the parts, per state; -1 for the trap.
  std::vector<int> relevant_;
  std::vector<int> slots_;  ///< Open addressing: state numbers, -1 free.
  std::vector<int> scratch_;
};

}  // namespace tether::ltl
