#include "tether/ltl/formula/parser.h"

#include <algorithm>
#include <map>
#include <utility>

#include "tether/ltl/formula/lexer.h"
#include "tether/ltl/formula/words.h"

namespace tether::ltl {
namespace {

/// Formulas are walked recursively: the tree of one must not be deeper than the stack.
constexpr int kMaxDepth = 500;

constexpr const char* kOperandAccepted =
    "accepted here: an atom, true, false, '(' or one of the operators ! X X[!] F G";

class Parser {
 public:
  Parser(std::string_view text, const Location& where) : lexer_(text), where_(where) { Advance(); }

  Formula Parse() {
    if (token_.kind == Token::Kind::kEnd) Fail(token_, "the formula is empty", kOperandAccepted);
    ParseInfix(0, 0, "");
    if (token_.kind == Token::Kind::kClose) {
      Fail(token_, "')' has no opening '('", "accepted here: an operator, or the end of the formula");
    }
    if (token_.kind != Token::Kind::kEnd) FailAfterFormula("or the end of the formula");
    return Formula::FromNodes(std::move(nodes_), std::move(atoms_));
  }

 private:
  [[noreturn]] void Fail(const Token& at, const std::string& message, const std::string& accepted) const {
    throw InputError(
        {{FormulaLocation(where_, at.column), FormulaPrefix(where_, at.column) + message, accepted}});
  }

  [[noreturn]] void FailAfterFormula(const std::string& or_else) {
    const Token unexpected = token_;
    std::string suggestion = OperatorFor(unexpected.text);
    if (!suggestion.empty()) suggestion = "did you mean '" + suggestion + "'? ";
    const bool word = unexpected.kind == Token::Kind::kOperand || unexpected.kind == Token::Kind::kPrefix ||
                      unexpected.kind == Token::Kind::kOpen;
    if (suggestion.empty() && word && !before_.empty()) suggestion = SuggestionForBefore(unexpected);
    Fail(unexpected, "unexpected '" + unexpected.text + "' where an operator is expected",
         suggestion + ("accepted here: & | -> <-> xor U R W M, " + or_else));
  }

  /// What the atom before an unexpected operand was probably meant to be: `always a`, `at red hall`.
  std::string SuggestionForBefore(const Token& unexpected) {
    const std::string symbol = OperatorFor(before_);
    if (!symbol.empty()) return "did you mean '" + symbol + "' for '" + before_ + "'? ";
    std::string arguments;
    for (Token next = unexpected; IsBareWord(next); next = lexer_.Next())
      arguments += (arguments.empty() ? "" : ",") + next.text;
    return arguments.empty() ? "" : "did you mean '" + before_ + "(" + arguments + ")'? ";
  }

  static bool IsBareWord(const Token& token) {
    return token.kind == Token::Kind::kOperand && token.op == Operator::kAtom && !token.quoted &&
           token.text.find('(') == std::string::npos;
  }

  void Advance() {
    before_.clear();
    token_ = lexer_.Next();
    if (token_.kind == Token::Kind::kError) Fail(token_, token_.text, token_.accepted);
  }

  void Push(Formula::Node node, const Token& at) {
    int depth = 0;
    for (int operand : node.operands) depth = std::max(depth, depths_[operand]);
    CheckDepth(++depth, at);
    nodes_.push_back(std::move(node));
    depths_.push_back(depth);
  }

  void CheckDepth(int depth, const Token& at) const {
    if (depth <= kMaxDepth) return;
    Fail(at, "the formula is nested too deeply at '" + at.text + "'",
         "at most " + std::to_string(kMaxDepth) + " operators within one another are accepted");
  }

  int Last() const { return static_cast<int>(nodes_.size()) - 1; }

  /// Appends the operands of the node just pushed, instead of the node, if it is of the same flat operator.
  void AddOperand(Operator op, std::vector<int>& operands) {
    const bool flat = op == Operator::kAnd || op == Operator::kOr;
    if (flat && nodes_.back().op == op) {
      operands.insert(operands.end(), nodes_.back().operands.begin(), nodes_.back().operands.end());
      nodes_.pop_back();
      depths_.pop_back();
    } else {
      operands.push_back(Last());
    }
  }

  /// Parses operators that bind at least as tightly as `level`; the result is the last node. `operand_of`
  /// names the operator whose operand this is.
  void ParseInfix(int level, int depth, const std::string& operand_of) {
    ParsePrefix(depth, operand_of);
    while (token_.kind == Token::Kind::kInfix && Precedence(token_.op) >= level) {
      const Token op = token_;
      std::vector<int> operands;
      AddOperand(op.op, operands);
      Advance();
      ParseInfix(Precedence(op.op) + (IsRightAssociative(op.op) ? 0 : 1), depth + 1, op.text);
      AddOperand(op.op, operands);
      Push({op.op, -1, std::move(operands), op.column}, op);
    }
  }

  void ParsePrefix(int depth, const std::string& operand_of) {
    const Token first = token_;
    CheckDepth(depth, first);
    switch (first.kind) {
      case Token::Kind::kOperand:
        Advance();
        if (IsBareWord(first)) before_ = first.text;
        Push({first.op,
              first.op == Operator::kAtom ? AtomIndex(first.text) : -1,
              {},
              first.column,
              first.quoted},
             first);
        return;
      case Token::Kind::kPrefix:
        Advance();
        ParsePrefix(depth + 1, first.text);
        Push({first.op, -1, {Last()}, first.column}, first);
        return;
      case Token::Kind::kOpen:
        Advance();
        ParseInfix(0, depth + 1, first.text);
        if (token_.kind == Token::Kind::kEnd) {
          Fail(first, "'(' has no closing ')'", "accepted at the end: ')'");
        }
        if (token_.kind != Token::Kind::kClose) FailAfterFormula("or ')'");
        Advance();
        return;
      case Token::Kind::kEnd:
        Fail(first, "the formula ends where " + Missing(operand_of), kOperandAccepted);
      default:
        Fail(first, "unexpected '" + first.text + "' where " + Missing(operand_of), kOperandAccepted);
    }
  }

  static std::string Missing(const std::string& operand_of) {
    if (operand_of.empty()) return "a formula is expected";
    if (operand_of == "(") return "a formula is expected after '('";
    return "an operand of '" + operand_of + "' is expected";
  }

  int AtomIndex(const std::string& name) {
    const auto [place, added] = atom_index_.emplace(name, static_cast<int>(atoms_.size()));
    if (added) atoms_.push_back(name);
    return place->second;
  }

  Lexer lexer_;
  Location where_;
  Token token_;
  std::string before_;  ///< The word that was read last, if it is an atom.
  std::vector<Formula::Node> nodes_;
  std::vector<int> depths_;
  std::vector<std::string> atoms_;
  std::map<std::string, int> atom_index_;
};

}  // namespace

Formula ParseFormula(std::string_view text, const Location& where) { return Parser(text, where).Parse(); }

void RequireKnownAtoms(const Formula& formula, const std::vector<std::string>& known, const Location& where) {
  Diagnostics diagnostics;
  std::vector<bool> told(formula.atoms().size());
  for (const Formula::Node& node : formula.nodes()) {
    if (node.op != Operator::kAtom || told[node.atom]) continue;
    told[node.atom] = true;
    const std::string& name = formula.atoms()[node.atom];
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    const std::string nearest = NearestMatch(name, known);
    const std::vector<std::string> some(known.begin(),
                                        known.begin() + std::min<ptrdiff_t>(8, std::ssize(known)));
    const std::string all = some.size() < known.size() ? "accepted, among others: " + JoinAlternatives(some)
                                                       : "accepted: " + JoinAlternatives(some);
    diagnostics.Add(FormulaLocation(where, node.column),
                    FormulaPrefix(where, node.column) + "unknown proposition '" + name + "'",
                    (nearest.empty() ? "" : "did you mean '" + nearest + "'? ") +
                        (known.empty() ? "there are no propositions here" : all));
  }
  diagnostics.ThrowIfAny();
}

Location FormulaLocation(const Location& where, int column) {
  if (where.file.empty() && where.line == 0) return {"formula", 1, column};
  return where;
}

std::string FormulaPrefix(const Location& where, int column) {
  if (where.file.empty() && where.line == 0) return "";
  return "column " + std::to_string(column) + " of the formula: ";
}

}  // namespace tether::ltl
