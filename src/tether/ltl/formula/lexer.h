#pragma once

#include <string>
#include <string_view>

#include "tether/ltl/formula/formula.h"

namespace tether::ltl {

/// How tightly an operator binds, as in Spot: -> and <-> the least, then |, xor, &, the infix temporal ones,
/// the prefix ones. Atoms and constants the most.
int Precedence(Operator op);
/// -> <-> U R W M; the others associate to the left.
bool IsRightAssociative(Operator op);

struct Token {
  enum class Kind { kEnd, kOperand, kPrefix, kInfix, kOpen, kClose, kError };

  Kind kind = Kind::kEnd;
  Operator op = Operator::kTrue;  ///< Of operands (an atom or a constant) and operators.
  std::string text;               ///< As written; for an atom, its name; for an error, what is wrong.
  std::string accepted;           ///< For an error: what would be accepted.
  int column = 1;                 ///< In characters from the beginning of the formula.
  bool quoted = false;            ///< An atom in double quotes.
};

/// Cuts the text of a formula into tokens.
class Lexer {
 public:
  explicit Lexer(std::string_view text) : text_(text) {}

  /// The next token; after the last, and after an error, kEnd for ever.
  Token Next();

 private:
  char Peek(size_t ahead = 0) const { return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0'; }
  void Skip(size_t count);
  void SkipBlanks();
  Token Take(Token::Kind kind, Operator op, size_t length);
  Token Error(std::string message, std::string accepted);
  Token LexWord();
  Token LexQuoted();
  Token LexArguments(Token atom);
  Token LexStranger();

  std::string_view text_;
  size_t at_ = 0;
  int column_ = 1;
};

/// The name that a quoted atom stands for: blanks in a ground predicate don't count, so that "on(a, b)" is
/// on(a,b). Any other text stays as it is.
std::string NormalizeAtom(std::string_view text);

}  // namespace tether::ltl
