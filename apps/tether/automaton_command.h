#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "tether/common/document/value.h"
#include "tether/ltl/automaton/automaton.h"
#include "tether/ltl/formula/formula.h"

namespace tether::app {

/// A formula with its minimal automaton, and the time of compiling it.
struct CompiledFormula {
  ltl::Formula formula;
  ltl::Semantics semantics = ltl::Semantics::kCosafe;
  std::optional<ltl::Automaton> automaton;  ///< Empty if it would be too large.
  double compile_s = 0;                     ///< From the text to the minimal automaton.
};

/// Throws InputError if `text` is no formula, `semantics` is neither "cosafe" nor "ltlf", or the formula
/// can't be read so. Logs what is allowed and probably not meant.
CompiledFormula CompileFormula(const std::string& text, const std::string& semantics);

/// Format `tether.automaton/1`, as text. The automaton must be there.
std::string WriteAutomatonReport(const CompiledFormula& compiled);
/// The same without states and edges, at once however many there are.
Value WriteAutomatonSummary(const CompiledFormula& compiled);

}  // namespace tether::app
