#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tether/common/error.h"
#include "tether/ltl/formula/formula.h"

namespace tether::ltl {

/// Words that other tools for LTLf do not read as propositions.

/// Whether `name` is `last` or `end`.
bool IsWordForTheEnd(std::string_view name);

/// With kLtlf, `last` (this is the last position: !X[!] true) and `end` (the word is over: G false, which
/// holds behind the last position only) in place of the atoms of these names, as flloat, lydia and LTLf2DFA
/// read them. Atoms in double quotes stay. With kCosafe words have no end: nothing changes.
Formula ReadEnds(const Formula& formula, Semantics semantics);

/// The operator that `word` is in other notations, as `always` is G; empty if it is none.
std::string OperatorFor(std::string_view word);

/// Atoms that look like operators: `always(a)`, and with kCosafe `last`.
std::vector<Diagnostic> WordWarnings(const Formula& formula, Semantics semantics, const Location& where = {});

}  // namespace tether::ltl
