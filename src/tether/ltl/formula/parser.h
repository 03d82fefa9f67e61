#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tether/common/error.h"
#include "tether/ltl/formula/formula.h"

namespace tether::ltl {

/// Reads a formula, in the notation of Spot and of the LTLf tools:
///
///   ! ~      & && /\      | || \/      xor ^      -> => -->      <-> <=> <-->      true 1   false 0
///   X   X[!]   F <>   G []   U   R V   W   M
///
/// Binding, tightest first: the prefix operators; U R W M (to the right); &; xor; |; -> and <-> (to the
/// right). Atoms are names, ground predicates such as on(box,shelf), or any text in double quotes. As in
/// Spot, a word that begins with F, G or X begins with that operator (GFa is G F a) unless a digit follows;
/// unlike in Spot, not if it is the name of a predicate: Free(a).
///
/// `where` is where the text begins, if it stands in a file; columns in messages count from the beginning of
/// the formula. Throws InputError with the column, the offending text and what would be accepted.
Formula ParseFormula(std::string_view text, const Location& where = {});

/// Throws InputError with one mistake for each atom of `formula` that is not among `known`, and the nearest
/// that is.
void RequireKnownAtoms(const Formula& formula, const std::vector<std::string>& known,
                       const Location& where = {});

/// The place of a column of a formula that stands at `where`, and how a message about it begins: the place
/// itself if the text is not from a file, else "column 8 of the formula: ".
Location FormulaLocation(const Location& where, int column);
std::string FormulaPrefix(const Location& where, int column);

}  // namespace tether::ltl
