#include "tether/ltl/automaton/output.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "tether/common/limits.h"

namespace tether::ltl {
namespace {

/// Between double quotes, as both HOA and DOT read it.
std::string Quote(std::string_view text) {
  std::string quoted = "\"";
  for (char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c == '\n' || c == '\r' ? ' ' : c;
  }
  return quoted + "\"";
}

/// "0&!1 | 2": atoms by their numbers.
std::string HoaLabel(const std::vector<Cube>& guard) {
  std::string text;
  for (const Cube& cube : guard) {
    if (!text.empty()) text += " | ";
    if (cube.literals.empty()) text += "t";
    for (size_t k = 0; k < cube.literals.size(); ++k) {
      const auto& [atom, value] = cube.literals[k];
      text += (k > 0 ? "&" : "") + std::string(value ? "" : "!") + std::to_string(atom);
    }
  }
  return text;
}

/// "(0|!1) & 2".
std::string HoaClauses(const std::vector<Cube>& clauses) {
  std::string text;
  for (const Cube& clause : clauses) {
    text += text.empty() ? "(" : " & (";
    for (size_t k = 0; k < clause.literals.size(); ++k) {
      const auto& [atom, value] = clause.literals[k];
      text += (k > 0 ? "|" : "") + std::string(value ? "" : "!") + std::to_string(atom);
    }
    text += ")";
  }
  return text;
}

/// Literals of each cube or clause, as JSON: `literals[value][atom]`.
std::string CubesText(const std::vector<Cube>& cubes, const std::vector<std::string> (&literals)[2]) {
  std::string text = "[";
  for (size_t i = 0; i < cubes.size(); ++i) {
    PollLimits();
    text += i > 0 ? ", [" : "[";
    for (size_t k = 0; k < cubes[i].literals.size(); ++k) {
      const auto& [atom, value] = cubes[i].literals[k];
      if (k > 0) text += ", ";
      text += literals[value ? 1 : 0][atom];
    }
    text += "]";
  }
  return text + "]";
}

std::string Pad(const std::string& text, size_t width) {
  return std::string(text.size() < width ? width - text.size() : 0, ' ') + text;
}

}  // namespace

std::string WriteHoa(const Automaton& automaton, const std::string& name, Semantics semantics) {
  std::string text = "HOA: v1\nname: " + Quote(name) + "\ntool: \"tether\"\n";
  text += "States: " + std::to_string(automaton.states()) + "\nStart: 0\n";
  text += "AP: " + std::to_string(automaton.atoms().size());
  for (const std::string& atom : automaton.atoms()) text += " " + Quote(atom);
  text += "\nacc-name: Buchi\nAcceptance: 1 Inf(0)\n";
  text += "properties: trans-labels explicit-labels state-acc complete deterministic";
  text += semantics == Semantics::kCosafe ? " weak terminal\n" : "\n";
  text += "--BODY--\n";
  int state = -1;
  for (const AutomatonEdge& edge : automaton.Edges()) {
    if (edge.from != state) {
      state = edge.from;
      text += "State: " + std::to_string(state) + (automaton.IsAccepting(state) ? " {0}\n" : "\n");
    }
    PollLimits();
    text += "[" + (edge.has_guard ? HoaLabel(edge.guard) : HoaClauses(edge.clauses)) + "] " +
            std::to_string(edge.to) + "\n";
  }
  return text + "--END--\n";
}

std::string WriteDot(const Automaton& automaton, const std::string& name) {
  std::string text = "digraph automaton {\n  label=" + Quote(name) + ";\n  labelloc=t;\n  rankdir=LR;\n";
  text += "  node [shape=circle];\n  start [shape=point];\n  start -> 0;\n";
  for (int s = 0; s < automaton.states(); ++s) {
    text += "  " + std::to_string(s);
    if (automaton.IsAccepting(s)) {
      text += " [shape=doublecircle]";
    } else if (automaton.IsTrap(s)) {
      text += " [style=dashed]";
    }
    text += ";\n";
  }
  const std::vector<std::string> texts = AtomTexts(automaton.atoms());
  for (const AutomatonEdge& edge : automaton.Edges()) {
    text += "  " + std::to_string(edge.from) + " -> " + std::to_string(edge.to) +
            " [label=" + Quote(GuardText(edge, texts)) + "];\n";
  }
  return text + "}\n";
}

Value WriteStates(const Automaton& automaton) {
  Value atoms = Value::Array(), accepting = Value::Array();
  for (const std::string& atom : automaton.atoms()) atoms.Append(atom);
  for (int s = 0; s < automaton.states(); ++s) {
    if (automaton.IsAccepting(s)) accepting.Append(s);
  }
  return Value::Object()
      .Set("atoms", std::move(atoms))
      .Set("states", automaton.states())
      .Set("initial", automaton.initial())
      .Set("accepting", std::move(accepting));
}

std::string WriteEdges(const Automaton& automaton) {
  // Literals occur often: each form is made once.
  const std::vector<std::string> texts = AtomTexts(automaton.atoms());
  std::vector<std::string> literals[2];
  for (const std::string& atom : texts) {
    literals[1].push_back(WriteJson(Value(atom), 0));
    literals[0].push_back(WriteJson(Value("!" + atom), 0));
  }
  std::string text = "[";
  const char* between = "";
  for (const AutomatonEdge& edge : automaton.Edges()) {
    text += std::exchange(between, ",");
    text += "\n    {\"from\": " + std::to_string(edge.from) + ", \"to\": " + std::to_string(edge.to);
    text += ", \"guard\": " + WriteJson(Value(GuardText(edge, texts)), 0);
    text += edge.has_guard ? ", \"cubes\": " + CubesText(edge.guard, literals)
                           : ", \"clauses\": " + CubesText(edge.clauses, literals);
    text += "}";
  }
  return text + "\n  ]";
}

std::string AutomatonTable(const Automaton& automaton, size_t max_lines) {
  const std::vector<AutomatonEdge> edges = automaton.Edges();
  const std::vector<std::string> texts = AtomTexts(automaton.atoms());
  const size_t width = std::max<size_t>(5, std::to_string(automaton.states()).size());
  std::string text = Pad("state", width) + "  " + Pad("to", width) + "  when\n";
  int state = -1;
  for (size_t i = 0; i < std::min(edges.size(), max_lines); ++i) {
    const AutomatonEdge& edge = edges[i];
    const bool first = std::exchange(state, edge.from) != edge.from;
    text += Pad(first ? std::to_string(edge.from) : "", width) + "  " + Pad(std::to_string(edge.to), width) +
            "  " + GuardText(edge, texts);
    if (first && automaton.IsAccepting(state)) text += "   (accepting)";
    if (first && automaton.IsTrap(state)) text += "   (lost)";
    text += "\n";
  }
  if (edges.size() > max_lines) {
    text += "… and " + std::to_string(edges.size() - max_lines) + " more transitions\n";
  }
  return text;
}

}  // namespace tether::ltl
