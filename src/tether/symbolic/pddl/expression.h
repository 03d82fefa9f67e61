#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tether/common/error.h"

namespace tether::symbolic {

/// A node of PDDL text: a word, or a list in parentheses.
struct Expression {
  bool is_list = false;
  std::string word;               ///< As written; empty for a list.
  std::vector<Expression> items;  ///< Empty for a word.
  Location where;                 ///< Of the word, or of the '('.

  /// The first item when that is a word, else empty.
  std::string_view head() const;
};

/// ASCII letters in lower case: PDDL doesn't tell cases apart.
std::string LowerCase(std::string_view text);

/// Reads the parentheses and words of `text`; `file` names it in errors. A ')' too many is reported and
/// skipped. On a '(' that is never closed, text that is no word, or nesting beyond 256 lists nothing is
/// returned, because what follows would be misread: the result is empty then, and `diagnostics` says why.
std::vector<Expression> ParseExpressions(std::string_view text, const std::string& file,
                                         Diagnostics& diagnostics);

}  // namespace tether::symbolic
