#include "tether/ltl/formula/words.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <utility>

#include "tether/ltl/formula/parser.h"

namespace tether::ltl {
namespace {

bool IsEndAtom(const Formula& formula, const Formula::Node& node) {
  return node.op == Operator::kAtom && !node.quoted && IsWordForTheEnd(formula.atoms()[node.atom]);
}

}  // namespace

bool IsWordForTheEnd(std::string_view name) { return name == "last" || name == "end"; }

Formula ReadEnds(const Formula& formula, Semantics semantics) {
  if (semantics != Semantics::kLtlf) return formula;
  std::vector<Formula::Node> nodes;
  std::vector<int> number;  // By node: its number from now on.
  std::vector<std::string> atoms;
  std::vector<int> atom_number(formula.atoms().size(), -1);  // Likewise; -1: not met.
  for (const Formula::Node& node : formula.nodes()) {
    if (IsEndAtom(formula, node)) {
      const bool last = formula.atoms()[node.atom] == "last";
      const auto above = [&](Operator op) {
        nodes.push_back({op, -1, {static_cast<int>(nodes.size()) - 1}, node.column});
      };
      nodes.push_back({last ? Operator::kTrue : Operator::kFalse, -1, {}, node.column});
      above(last ? Operator::kStrongNext : Operator::kAlways);
      if (last) above(Operator::kNot);
    } else {
      nodes.push_back(node);
      for (int& operand : nodes.back().operands) operand = number[operand];
      if (node.op == Operator::kAtom) {
        int& atom = atom_number[node.atom];
        if (atom < 0) {
          atom = static_cast<int>(atoms.size());
          atoms.push_back(formula.atoms()[node.atom]);
        }
        nodes.back().atom = atom;
      }
    }
    number.push_back(static_cast<int>(nodes.size()) - 1);
  }
  return Formula::FromNodes(std::move(nodes), std::move(atoms));
}

std::string OperatorFor(std::string_view word) {
  static const std::map<std::string, std::string, std::less<>> words{
      {"and", "&"},           {"or", "|"},       {"not", "!"},      {"implies", "->"},   {"iff", "<->"},
      {"equiv", "<->"},       {"until", "U"},    {"next", "X"},     {"always", "G"},     {"globally", "G"},
      {"release", "R"},       {"finally", "F"},  {"releases", "R"}, {"eventually", "F"}, {"sometime", "F"},
      {"weakuntil", "W"},     {"u", "U"},        {"r", "R"},        {"w", "W"},          {"m", "M"},
      {"strongnext", "X[!]"}, {"weaknext", "X"}, {"wx", "X"},       {"n", "X"},          {"inally", "F"},
      {"lobally", "G"}};
  if (word == "XOR") return "xor";
  std::string lower(word);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const auto found = words.find(lower);
  return found == words.end() ? "" : found->second;
}

std::vector<Diagnostic> WordWarnings(const Formula& formula, Semantics semantics, const Location& where) {
  std::vector<Diagnostic> warnings;
  std::vector<bool> told(formula.atoms().size(), false);
  for (const Formula::Node& node : formula.nodes()) {
    if (node.op != Operator::kAtom || node.quoted || told[node.atom]) continue;
    told[node.atom] = true;
    const std::string& name = formula.atoms()[node.atom];
    const auto warn = [&](const std::string& message, const std::string& accepted) {
      warnings.push_back(
          {FormulaLocation(where, node.column), FormulaPrefix(where, node.column) + message, accepted});
    };
    const size_t open = name.find('(');
    const std::string symbol = open == std::string::npos ? "" : OperatorFor(name.substr(0, open));
    if (!symbol.empty()) {
      warn("'" + name + "' is a proposition here",
           "for the operator, write " + symbol + "; in double quotes it is meant");
    } else if (IsWordForTheEnd(name) && semantics == Semantics::kCosafe) {
      warn("'" + name + "' is a proposition here: under 'cosafe' words have no end",
           "for the end of the word, the semantics 'ltlf'");
    }
  }
  return warnings;
}

}  // namespace tether::ltl
