#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "tether/ltl/automaton/automaton.h"

namespace tether::ltl {

/// One of the automata whose intersection a LazyAutomaton is: compiled as a whole, or built by progression as
/// it is visited. State 0 is the initial one.
class AutomatonPart {
 public:
  virtual ~AutomatonPart() = default;

  /// The state after `state` reads a letter of the whole formula. May create states.
  virtual int Step(int state, LetterView letter) = 0;
  virtual bool IsAccepting(int state) const = 0;
  /// Every continuation is accepted.
  virtual bool IsSettled(int state) const = 0;
  /// A lower bound on the number of letters to acceptance; Automaton::kNever where it can't be reached.
  virtual int LowerBound(int state) const = 0;
  virtual const std::vector<int>& RelevantAtoms(int state) const = 0;
  /// Null if the part is progressed.
  virtual const Automaton* automaton() const { return nullptr; }
};

/// Splits a formula at its conjunctions. Parts that share atoms are one, as long as it has at most
/// `max_states` states and `max_nodes` nodes; a conjunct that is larger by itself is progressed.
std::vector<std::unique_ptr<AutomatonPart>> SplitIntoParts(const Formula& formula, Semantics semantics,
                                                           size_t max_states, size_t max_nodes);

}  // namespace tether::ltl
