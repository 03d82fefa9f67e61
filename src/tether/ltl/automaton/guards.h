#pragma once

#include <vector>

#include "tether/ltl/automaton/automaton.h"
#include "tether/ltl/automaton/diagram.h"

namespace tether::ltl {

/// The transitions of an automaton with their guards; see Automaton::Edges().
std::vector<AutomatonEdge> FindGuards(const Diagram& diagram, GuardForms forms);

}  // namespace tether::ltl
