#pragma once

#include <string>

#include "tether/common/document/value.h"
#include "tether/ltl/automaton/automaton.h"

namespace tether::ltl {

/// The Hanoi omega-automata format, version 1 (Babiak et al., CAV 2015), as Spot's tools read it. States that
/// accept are in set 0 under "Buchi" acceptance. For Semantics::kCosafe this is also right for endless words:
/// an accepting state is never left, and the automaton says `terminal`. For Semantics::kLtlf it is the
/// convention of tools for finite words: a finite word is accepted if it ends in set 0.
std::string WriteHoa(const Automaton& automaton, const std::string& name, Semantics semantics);

/// For graphviz: `dot -Tsvg`.
std::string WriteDot(const Automaton& automaton, const std::string& name);

/// Members `atoms`, `states` (their number), `initial` and `accepting` (states).
Value WriteStates(const Automaton& automaton);
/// JSON, a list with a line for each edge: {from, to, guard (a formula), cubes (lists of literals; one cube
/// of no literals for "always")}.
std::string WriteEdges(const Automaton& automaton);

/// For people: a line per edge, states that accept or are lost marked, at most `max_lines` of them.
std::string AutomatonTable(const Automaton& automaton, size_t max_lines);

}  // namespace tether::ltl
