#pragma once

#include <string>
#include <vector>

#include "tether/common/error.h"
#include "tether/ltl/formula/formula.h"

namespace tether::ltl {

/// An operator that makes a formula not co-safe.
struct CosafeViolation {
  int column = 0;  ///< Of the operator, from 1; 0 if the formula was not parsed.
  std::string message;
};

/// The operators that keep a formula from being (syntactically) co-safe, by column; none if it is. In
/// negation normal form a co-safe formula has literals, & | X F U M only (paper B, section 2.1; Kupferman and
/// Vardi, 2001): G, R and W require something for ever, and so do F, U and M under a negation. X is its own
/// dual here: the word goes on.
std::vector<CosafeViolation> WhyNotCosafe(const Formula& formula);

/// Throws InputError with all of these if the formula can't be read with `semantics`.
void RequireSemantics(const Formula& formula, Semantics semantics, const Location& where = {});

/// Warnings about what is allowed and probably not meant: under kLtlf, a weak X by which an operand can hold
/// at the end of the word, as in F(a & X F b), which holds if a holds at the last position.
std::vector<Diagnostic> SemanticsWarnings(const Formula& formula, Semantics semantics,
                                          const Location& where = {});

/// "cosafe" or "ltlf"; throws InputError for anything else.
Semantics ReadSemantics(const std::string& name);

}  // namespace tether::ltl
