#include "tether/ltl/formula/formula.h"

#include <algorithm>
#include <cassert>
#include <iterator>

#include "tether/ltl/formula/lexer.h"

namespace tether::ltl {
namespace {

int Arity(Operator op) {
  switch (op) {
    case Operator::kFalse:
    case Operator::kTrue:
    case Operator::kAtom:
      return 0;
    case Operator::kNot:
    case Operator::kNext:
    case Operator::kStrongNext:
    case Operator::kEventually:
    case Operator::kAlways:
      return 1;
    default:
      return 2;
  }
}

bool IsWord(std::string_view text) { return !text.empty() && text != "!"; }

/// Prints one node; operands that bind less tightly than it get parentheses.
class Printer {
 public:
  explicit Printer(const Formula& formula) : formula_(formula) {}

  std::string Print(int i) const {
    const Formula::Node& node = formula_.node(i);
    switch (Arity(node.op)) {
      case 0:
        if (node.op == Operator::kAtom) return AtomText(formula_.atoms()[node.atom]);
        return std::string(Symbol(node.op));
      case 1:
        return PrintUnary(node);
      default:
        return PrintInfix(node);
    }
  }

 private:
  std::string PrintUnary(const Formula::Node& node) const {
    const std::string symbol(Symbol(node.op));
    const int operand = node.operands.front();
    if (Precedence(formula_.node(operand).op) < Precedence(node.op)) {
      return symbol + "(" + Print(operand) + ")";
    }
    return symbol + (IsWord(symbol) ? " " : "") + Print(operand);
  }

  std::string PrintInfix(const Formula::Node& node) const {
    const bool flat = node.op == Operator::kAnd || node.op == Operator::kOr;
    const bool right = IsRightAssociative(node.op);
    std::string text;
    for (size_t k = 0; k < node.operands.size(); ++k) {
      const int operand = node.operands[k];
      const int level = Precedence(formula_.node(operand).op);
      const bool tight_side = !flat && (right ? k == 0 : k == 1);
      const bool parentheses = level < Precedence(node.op) || (level == Precedence(node.op) && tight_side);
      if (k > 0) text += " " + std::string(Symbol(node.op)) + " ";
      text += parentheses ? "(" + Print(operand) + ")" : Print(operand);
    }
    return text;
  }

  const Formula& formula_;
};

bool Equal(const Formula& a, int i, const Formula& b, int j) {
  const Formula::Node& x = a.node(i);
  const Formula::Node& y = b.node(j);
  if (x.op != y.op || x.operands.size() != y.operands.size()) return false;
  if (x.op == Operator::kAtom) {
    return a.atoms()[x.atom] == b.atoms()[y.atom];
  }
  for (size_t k = 0; k < x.operands.size(); ++k) {
    if (!Equal(a, x.operands[k], b, y.operands[k])) return false;
  }
  return true;
}

}  // namespace

std::string ToString(Semantics semantics) { return semantics == Semantics::kCosafe ? "cosafe" : "ltlf"; }

std::string_view Symbol(Operator op) {
  switch (op) {
    case Operator::kFalse:
      return "false";
    case Operator::kTrue:
      return "true";
    case Operator::kAtom:
      return "";
    case Operator::kNot:
      return "!";
    case Operator::kNext:
      return "X";
    case Operator::kStrongNext:
      return "X[!]";
    case Operator::kEventually:
      return "F";
    case Operator::kAlways:
      return "G";
    case Operator::kUntil:
      return "U";
    case Operator::kRelease:
      return "R";
    case Operator::kWeakUntil:
      return "W";
    case Operator::kStrongRelease:
      return "M";
    case Operator::kAnd:
      return "&";
    case Operator::kXor:
      return "xor";
    case Operator::kOr:
      return "|";
    case Operator::kImplies:
      return "->";
    case Operator::kEquivalent:
      return "<->";
  }
  return "";
}

Formula::Formula() { nodes_.push_back({}); }

Formula Formula::Constant(bool value, int column) {
  Formula formula;
  formula.nodes_.back().op = value ? Operator::kTrue : Operator::kFalse;
  formula.nodes_.back().column = column;
  return formula;
}

Formula Formula::Atom(std::string_view name, int column) {
  Formula formula;
  formula.nodes_.back() = {Operator::kAtom, 0, {}, column};
  formula.atoms_.emplace_back(name);
  return formula;
}

Formula Formula::Make(Operator op, std::initializer_list<Formula> operands, int column) {
  return Make(op, std::span<const Formula>(operands.begin(), operands.size()), column);
}

Formula Formula::Make(Operator op, std::span<const Formula> operands, int column) {
  [[maybe_unused]] const auto count = static_cast<int>(operands.size());
  const bool flat = op == Operator::kAnd || op == Operator::kOr;
  assert(flat ? count >= 2 : count == Arity(op));
  Formula formula;
  formula.nodes_.clear();
  Node root{op, -1, {}, column};
  for (const Formula& operand : operands) {
    const int index = formula.Append(operand);
    if (flat && formula.nodes_.back().op == op) {
      std::vector<int> inner = std::move(formula.nodes_.back().operands);
      formula.nodes_.pop_back();
      root.operands.insert(root.operands.end(), inner.begin(), inner.end());
    } else {
      root.operands.push_back(index);
    }
  }
  formula.nodes_.push_back(std::move(root));
  return formula;
}

Formula Formula::FromNodes(std::vector<Node> nodes, std::vector<std::string> atoms) {
  assert(!nodes.empty());
  Formula formula;
  formula.nodes_ = std::move(nodes);
  formula.atoms_ = std::move(atoms);
  return formula;
}

int Formula::Append(const Formula& operand) {
  std::vector<int> atom_map;
  for (const std::string& name : operand.atoms_) {
    const auto found = std::find(atoms_.begin(), atoms_.end(), name);
    atom_map.push_back(static_cast<int>(std::distance(atoms_.begin(), found)));
    if (found == atoms_.end()) atoms_.push_back(name);
  }
  const int shift = static_cast<int>(nodes_.size());
  for (Node node : operand.nodes_) {
    if (node.atom >= 0) node.atom = atom_map[node.atom];
    for (int& child : node.operands) child += shift;
    nodes_.push_back(std::move(node));
  }
  return root();
}

Formula Formula::Sub(int i) const {
  const Node& top = node(i);
  if (top.op == Operator::kAtom) return Atom(atoms_[top.atom], top.column);
  if (top.operands.empty()) return Constant(top.op == Operator::kTrue, top.column);
  std::vector<Formula> operands;
  for (int operand : top.operands) operands.push_back(Sub(operand));
  return Make(top.op, operands, top.column);
}

std::string Formula::ToString() const { return Printer(*this).Print(root()); }

bool operator==(const Formula& a, const Formula& b) { return Equal(a, a.root(), b, b.root()); }

Letter MakeLetter(const std::vector<std::string>& atoms, const std::vector<std::string>& names) {
  Letter letter(LetterWords(atoms.size()));
  for (size_t i = 0; i < atoms.size(); ++i) {
    if (std::find(names.begin(), names.end(), atoms[i]) != names.end()) letter[i / 64] |= 1ull << (i % 64);
  }
  return letter;
}

}  // namespace tether::ltl
