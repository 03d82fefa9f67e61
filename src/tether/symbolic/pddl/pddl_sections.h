#pragma once

#include "tether/symbolic/pddl/expression.h"
#include "tether/symbolic/pddl/pddl.h"

namespace tether::symbolic {

/// Readers of the sections that costs and derived predicates stand in. Mistakes are reported, and what is
/// wrong is left out.

/// `(:types truck - vehicle place vehicle)`: a tree below `object`.
void ParseTypes(const Expression& section, Domain& domain, Diagnostics& diagnostics);

/// `(:functions (total-cost) (distance ?a ?b - place) - number)`.
void ParseFunctions(const Expression& section, Domain& domain, Diagnostics& diagnostics);

/// `(= (distance here there) 3)` in `:init`.
void ParseValue(const Expression& item, Problem& problem, const Domain& domain, Diagnostics& diagnostics);

/// `(:metric minimize (total-cost))`.
void ParseMetric(const Expression& section, Problem& problem, const Domain& domain, Diagnostics& diagnostics);

/// `(:derived (above ?a ?b - block) formula)`. Adds a rule and gives its predicate stratum 1.
void ParseDerived(const Expression& section, Domain& domain, Diagnostics& diagnostics);

/// Finds the strata of derived predicates; reports rules through which a predicate depends on its own
/// negation.
void Stratify(Domain& domain, Diagnostics& diagnostics);

}  // namespace tether::symbolic
