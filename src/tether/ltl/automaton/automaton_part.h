#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "tether/ltl/automaton/automaton.h"

namespace tether::ltl {

/// One automaton of the intersection that a LazyAutomaton is: compiled as a whole, or progressed as it is
/// visited. State 0 is the initial one.
class AutomatonPart {
 public:
  virtual ~AutomatonPart() = default;

  virtual int Step(int state, LetterView letter) = 0;
  virtual bool IsAccepting(int state) const = 0;
  /// Everything is accepted from here on.
  virtual bool IsSettled(int state) const = 0;
  /// At least so many letters to acceptance; Automaton::kNever where there is none.
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
