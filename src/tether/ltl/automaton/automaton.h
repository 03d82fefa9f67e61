#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tether/ltl/automaton/diagram.h"
#include "tether/ltl/formula/formula.h"

namespace tether::ltl {

/// Atoms that must be true or false, each in the order of the atoms; others don't matter.
struct Cube {
  std::vector<std::pair<int, bool>> literals;
};

/// A transition: any letter that lies in one of `guard`'s cubes.
struct AutomatonEdge {
  int from = 0;
  int to = 0;
  std::vector<Cube> guard;    ///< None of them can be left out.
  std::vector<Cube> clauses;  ///< The same condition: one literal of each must hold. Empty: always.
  bool has_guard = true;      ///< Otherwise `guard` would have thousands of cubes, and is empty;
  bool has_clauses = true;    ///< likewise `clauses`.
};

/// Of the two forms of a guard, one may be exponentially longer than the other, or both than the formula.
enum class GuardForms {
  kShort,       ///< Those that are not too long: both, one or none.
  kAtLeastOne,  ///< If both are too long, the guard nevertheless, within the limits of the thread.
};

/// The minimal complete deterministic automaton of a formula. State 0 is the initial one. Immutable: safe to
/// share between threads.
class Automaton {
 public:
  /// The distance where acceptance can't be reached.
  static constexpr int kNever = 0x3fffffff;

  /// `diagram` must be minimal, with initial state 0.
  Automaton(std::vector<std::string> atoms, Diagram diagram);

  const std::vector<std::string>& atoms() const { return atoms_; }
  const Diagram& diagram() const { return diagram_; }
  int states() const { return static_cast<int>(diagram_.states()); }
  static constexpr int initial() { return 0; }

  bool IsAccepting(int state) const { return diagram_.accepting[static_cast<size_t>(state)]; }
  /// No continuation is accepted.
  bool IsTrap(int state) const { return distance(state) == kNever; }
  /// Every continuation is accepted.
  bool IsSettled(int state) const {
    return IsAccepting(state) && diagram_.roots[static_cast<size_t>(state)] == ~state;
  }
  /// Fewest letters from `state` to an accepting state; kNever if there is none.
  int distance(int state) const { return distance_[static_cast<size_t>(state)]; }

  /// The state after `state` reads a letter.
  int Step(int state, LetterView letter) const;
  bool Accepts(const Word& word) const;
  /// The atoms that the step from `state` depends on, in increasing order.
  std::vector<int> RelevantAtoms(int state) const;

  /// Whether some word with at least one letter is accepted.
  bool IsSatisfiable() const;

  /// All transitions, by state, then by target. The guards are irredundant sums of products (Minato, 1993).
  std::vector<AutomatonEdge> Edges(GuardForms forms = GuardForms::kAtLeastOne) const;

 private:
  void MeasureDistances();

  std::vector<std::string> atoms_;
  Diagram diagram_;
  std::vector<int> distance_;
};

/// "a & !b | c" or "(a | c) & (!b | c)", whichever is shorter; "true" for everything. `texts` are the atoms
/// as AtomText() writes them.
std::string GuardText(const AutomatonEdge& edge, const std::vector<std::string>& texts);
std::vector<std::string> AtomTexts(const std::vector<std::string>& atoms);

/// Compiles a formula: Boolean operators above temporal ones by products of minimal automata, small ones
/// first; temporal ones by progression. Empty if an intermediate diagram would exceed the limits. Throws
/// InputError if the formula can't be read with `semantics`.
std::optional<Automaton> BuildAutomaton(const Formula& formula, Semantics semantics,
                                        const DiagramLimits& limits = {});

}  // namespace tether::ltl
