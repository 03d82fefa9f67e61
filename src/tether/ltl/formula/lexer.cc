#include "tether/ltl/formula/lexer.h"

#include "tether/ltl/formula/words.h"

#include <algorithm>
#include <array>
#include <utility>

#include "tether/common/text.h"

namespace tether::ltl {
namespace {

struct Spelling {
  std::string_view text;
  Token::Kind kind;
  Operator op;
};

/// Longer spellings come before those they begin with.
constexpr std::array kSpellings{
    Spelling{"<-->", Token::Kind::kInfix, Operator::kEquivalent},
    Spelling{"<->", Token::Kind::kInfix, Operator::kEquivalent},
    Spelling{"<=>", Token::Kind::kInfix, Operator::kEquivalent},
    Spelling{"-->", Token::Kind::kInfix, Operator::kImplies},
    Spelling{"->", Token::Kind::kInfix, Operator::kImplies},
    Spelling{"=>", Token::Kind::kInfix, Operator::kImplies},
    Spelling{"<>", Token::Kind::kPrefix, Operator::kEventually},
    Spelling{"[]", Token::Kind::kPrefix, Operator::kAlways},
    Spelling{"&&", Token::Kind::kInfix, Operator::kAnd},
    Spelling{"&", Token::Kind::kInfix, Operator::kAnd},
    Spelling{"/\\", Token::Kind::kInfix, Operator::kAnd},
    Spelling{"||", Token::Kind::kInfix, Operator::kOr},
    Spelling{"|", Token::Kind::kInfix, Operator::kOr},
    Spelling{"\\/", Token::Kind::kInfix, Operator::kOr},
    Spelling{"^", Token::Kind::kInfix, Operator::kXor},
    Spelling{"!", Token::Kind::kPrefix, Operator::kNot},
    Spelling{"~", Token::Kind::kPrefix, Operator::kNot},
    Spelling{"(", Token::Kind::kOpen, Operator::kTrue},
    Spelling{")", Token::Kind::kClose, Operator::kTrue},
};

constexpr std::array kInfixWords{
    Spelling{"U", Token::Kind::kInfix, Operator::kUntil},
    Spelling{"R", Token::Kind::kInfix, Operator::kRelease},
    Spelling{"V", Token::Kind::kInfix, Operator::kRelease},
    Spelling{"W", Token::Kind::kInfix, Operator::kWeakUntil},
    Spelling{"M", Token::Kind::kInfix, Operator::kStrongRelease},
    Spelling{"xor", Token::Kind::kInfix, Operator::kXor},
};

bool IsLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool IsDigit(char c) { return c >= '0' && c <= '9'; }
bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f' || c == '\v'; }
bool IsPrefixLetter(char c) { return c == 'F' || c == 'G' || c == 'X'; }

/// Letters, digits, dots, and hyphens within.
size_t WordLength(std::string_view text) {
  size_t length = 0;
  while (length < text.size()) {
    const char c = text[length];
    const bool hyphen = c == '-' && length > 0 && length + 1 < text.size() &&
                        (IsLetter(text[length + 1]) || IsDigit(text[length + 1]));
    if (!IsLetter(c) && !IsDigit(c) && c != '.' && !hyphen) break;
    ++length;
  }
  return length;
}

/// An argument may begin with a digit, and have '@' and '#' in it: objects of PDDL are called so.
size_t ArgumentLength(std::string_view text) {
  size_t length = 0;
  while (length < text.size()) {
    const std::string_view rest = text.substr(length);
    const size_t more = rest.front() == '@' || rest.front() == '#' ? 1 : WordLength(rest);
    if (more == 0) break;
    length += more;
  }
  return length;
}

bool EqualsIgnoringCase(std::string_view a, std::string_view b) { return LowerCase(a) == b; }

/// One character of UTF-8, or one byte if it is none.
size_t CharacterLength(std::string_view text) {
  size_t length = 1;
  if ((static_cast<unsigned char>(text[0]) & 0xc0) != 0xc0) return length;
  while (length < text.size() && length < 4 && (static_cast<unsigned char>(text[length]) & 0xc0) == 0x80)
    ++length;
  return length;
}

/// Whether `text` is written without quotes and stands for itself.
bool IsBareAtom(std::string_view text) {
  Lexer lexer(text);
  const Token atom = lexer.Next();
  return atom.kind == Token::Kind::kOperand && atom.op == Operator::kAtom && atom.text == text &&
         text.front() != '"' && lexer.Next().kind == Token::Kind::kEnd;
}

}  // namespace

int Precedence(Operator op) {
  switch (op) {
    case Operator::kImplies:
    case Operator::kEquivalent:
      return 1;
    case Operator::kOr:
      return 2;
    case Operator::kXor:
      return 3;
    case Operator::kAnd:
      return 4;
    case Operator::kUntil:
    case Operator::kRelease:
    case Operator::kWeakUntil:
    case Operator::kStrongRelease:
      return 5;
    case Operator::kNot:
    case Operator::kNext:
    case Operator::kStrongNext:
    case Operator::kEventually:
    case Operator::kAlways:
      return 6;
    case Operator::kFalse:
    case Operator::kTrue:
    case Operator::kAtom:
      break;
  }
  return 7;
}

bool IsRightAssociative(Operator op) { return Precedence(op) == 1 || Precedence(op) == 5; }

void Lexer::Skip(size_t count) {
  for (; count > 0; --count, ++at_) {
    if ((static_cast<unsigned char>(text_[at_]) & 0xc0) != 0x80) ++column_;
  }
}

void Lexer::SkipBlanks() {
  while (at_ < text_.size() && IsBlank(text_[at_])) Skip(1);
}

Token Lexer::Take(Token::Kind kind, Operator op, size_t length) {
  Token token{kind, op, std::string(text_.substr(at_, length)), "", column_};
  Skip(length);
  return token;
}

Token Lexer::Error(std::string message, std::string accepted) {
  Token token{Token::Kind::kError, Operator::kTrue, std::move(message), std::move(accepted), column_};
  at_ = text_.size();
  return token;
}

Token Lexer::Next() {
  SkipBlanks();
  if (at_ >= text_.size()) return {Token::Kind::kEnd, Operator::kTrue, "", "", column_};
  const char c = Peek();
  if (c == '"') return LexQuoted();
  if (IsLetter(c) || IsDigit(c)) return LexWord();
  for (const Spelling& spelling : kSpellings) {
    if (text_.substr(at_).starts_with(spelling.text)) {
      return Take(spelling.kind, spelling.op, spelling.text.size());
    }
  }
  return LexStranger();
}

Token Lexer::LexWord() {
  const std::string_view word = text_.substr(at_, WordLength(text_.substr(at_)));
  if (word == "1" || EqualsIgnoringCase(word, "true")) {
    return Take(Token::Kind::kOperand, Operator::kTrue, word.size());
  }
  if (word == "0" || EqualsIgnoringCase(word, "false")) {
    return Take(Token::Kind::kOperand, Operator::kFalse, word.size());
  }
  if (IsDigit(word.front())) {
    return Error("'" + std::string(word) + "' begins with a digit",
                 "accepted: 0, 1, a name that begins with a letter, or the name in double quotes");
  }
  for (const Spelling& infix : kInfixWords) {
    if (word == infix.text) return Take(infix.kind, infix.op, word.size());
  }
  const bool only_prefixes = std::all_of(word.begin(), word.end(), IsPrefixLetter);
  const bool predicate = Peek(word.size()) == '(' && !only_prefixes;
  if (IsPrefixLetter(word.front()) && !predicate && !(word.size() > 1 && IsDigit(word[1]))) {
    if (word.front() == 'F') return Take(Token::Kind::kPrefix, Operator::kEventually, 1);
    if (word.front() == 'G') return Take(Token::Kind::kPrefix, Operator::kAlways, 1);
    if (text_.substr(at_).starts_with("X[!]")) return Take(Token::Kind::kPrefix, Operator::kStrongNext, 4);
    return Take(Token::Kind::kPrefix, Operator::kNext, 1);
  }
  return LexArguments(Take(Token::Kind::kOperand, Operator::kAtom, word.size()));
}

Token Lexer::LexArguments(Token atom) {
  const std::string symbol = OperatorFor(atom.text);
  const std::string meant = symbol.empty() ? "" : "did you mean '" + symbol + "' for '" + atom.text + "'? ";
  size_t ahead = 0;
  while (IsBlank(Peek(ahead))) ++ahead;
  if (Peek(ahead) != '(') return atom;
  Skip(ahead + 1);
  const std::string name = atom.text;
  std::string arguments;
  for (SkipBlanks(); Peek() != ')'; SkipBlanks()) {
    if (at_ >= text_.size()) {
      Token error =
          Error("'" + name + "(' has no closing ')'", "accepted: names, with commas between them, and ')'");
      error.column = atom.column;
      return error;
    }
    const size_t length = ArgumentLength(text_.substr(at_));
    if (length == 0) {
      return Error(
          "'" + std::string(text_.substr(at_, CharacterLength(text_.substr(at_)))) +
              "' among the arguments of '" + name + "'",
          meant + "accepted: names, with commas between them; or is an operator missing before '('?");
    }
    arguments += (arguments.empty() ? "" : ",") + std::string(text_.substr(at_, length));
    Skip(length);
    SkipBlanks();
    if (Peek() == ',') {
      Skip(1);
      SkipBlanks();
      if (Peek() == ')')
        return Error("an argument of '" + name + "' is missing after ','", "accepted: a name");
    } else if (at_ < text_.size() && Peek() != ')') {
      return Error("'" + std::string(text_.substr(at_, CharacterLength(text_.substr(at_)))) +
                       "' among the arguments of '" + name + "'",
                   meant + "accepted: ',' or ')'; or is an operator missing before '('?");
    }
  }
  Skip(1);
  if (!arguments.empty()) atom.text += "(" + arguments + ")";
  return atom;
}

Token Lexer::LexQuoted() {
  Token atom{Token::Kind::kOperand, Operator::kAtom, "", "", column_};
  Skip(1);
  std::string name;
  while (at_ < text_.size() && Peek() != '"') {
    if (Peek() == '\\' && (Peek(1) == '"' || Peek(1) == '\\')) Skip(1);
    name += Peek();
    Skip(1);
  }
  if (at_ >= text_.size() || name.empty()) {
    Token error = Error(name.empty() ? "an empty name in quotes" : "'\"' has no closing '\"'",
                        "accepted: a name in double quotes");
    error.column = atom.column;
    return error;
  }
  Skip(1);
  atom.quoted = true;
  atom.text = NormalizeAtom(name);
  return atom;
}

Token Lexer::LexStranger() {
  const std::string character(text_.substr(at_, CharacterLength(text_.substr(at_))));
  if (character == "[") {
    return Error("unexpected '['", "accepted: [!] right after X, and [] for G; X[3] is written X X X");
  }
  const bool printable = static_cast<unsigned char>(character.front()) > ' ' && character.front() != 0x7f;
  return Error(printable ? "unexpected '" + character + "'" : "unexpected control character",
               "accepted: operators ! & | -> <-> xor X X[!] F G U R W M, parentheses, true, false, and "
               "names; other characters within double quotes");
}

std::string NormalizeAtom(std::string_view text) {
  if (text.find('"') != std::string_view::npos) return std::string(text);
  Lexer lexer(text);
  const Token atom = lexer.Next();
  const bool one = atom.kind == Token::Kind::kOperand && atom.op == Operator::kAtom &&
                   lexer.Next().kind == Token::Kind::kEnd;
  return one && atom.text.find('(') != std::string::npos ? atom.text : std::string(text);
}

std::string AtomText(std::string_view name) {
  if (!name.empty() && IsBareAtom(name) && !IsWordForTheEnd(name)) return std::string(name);
  std::string text = "\"";
  for (char c : name) {
    if (c == '"' || c == '\\') text += '\\';
    text += c;
  }
  return text + "\"";
}

}  // namespace tether::ltl
