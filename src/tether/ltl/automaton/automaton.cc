#include "tether/ltl/automaton/automaton.h"

#include <algorithm>
#include <utility>

#include "tether/ltl/automaton/compiler.h"
#include "tether/ltl/automaton/guards.h"

namespace tether::ltl {

Automaton::Automaton(std::vector<std::string> atoms, Diagram diagram)
    : atoms_(std::move(atoms)), diagram_(std::move(diagram)) {
  MeasureDistances();
}

// Distances, backwards from the accepting states: a state costs one letter, a node nothing.
void Automaton::MeasureDistances() {
  const size_t states = diagram_.states(), nodes = diagram_.nodes.size();
  // Vertices are states, then nodes; the predecessors of each, packed.
  const auto vertex = [&](Target t) {
    return t < 0 ? static_cast<size_t>(~t) : states + static_cast<size_t>(t);
  };
  std::vector<size_t> begin(states + nodes + 1);
  const auto for_each_edge = [&](const auto& visit) {
    for (size_t s = 0; s < states; ++s) visit(s, vertex(diagram_.roots[s]));
    for (size_t i = 0; i < nodes; ++i) {
      visit(states + i, vertex(diagram_.nodes[i].low));
      visit(states + i, vertex(diagram_.nodes[i].high));
    }
  };
  for_each_edge([&](size_t, size_t to) { ++begin[to + 1]; });
  for (size_t v = 0; v < states + nodes; ++v) begin[v + 1] += begin[v];
  std::vector<size_t> sources(begin.back()), fill(begin.begin(), begin.end() - 1);
  for_each_edge([&](size_t from, size_t to) { sources[fill[to]++] = from; });

  std::vector<int> distance(states + nodes, kNever);
  std::vector<size_t> layer, next;
  for (size_t s = 0; s < states; ++s) {
    if (!diagram_.accepting[s]) continue;
    distance[s] = 0;
    layer.push_back(s);
  }
  for (int d = 0; !layer.empty(); ++d) {
    next.clear();
    for (size_t i = 0; i < layer.size(); ++i) {
      const size_t v = layer[i];
      for (size_t k = begin[v]; k < begin[v + 1]; ++k) {
        const size_t from = sources[k];
        if (distance[from] != kNever) continue;
        distance[from] = from < states ? d + 1 : d;
        (from < states ? next : layer).push_back(from);
      }
    }
    layer.swap(next);
  }
  distance_.assign(distance.begin(), distance.begin() + static_cast<ptrdiff_t>(states));
}

int Automaton::Step(int state, LetterView letter) const {
  Target target = diagram_.roots[state];
  while (target >= 0) {
    const Diagram::Node& node = diagram_.nodes[target];
    target = IsTrue(letter, node.atom) ? node.high : node.low;
  }
  return ~target;
}

bool Automaton::Accepts(const Word& word) const {
  int state = initial();
  for (const Letter& letter : word) state = Step(state, letter);
  return IsAccepting(state);
}

std::vector<int> Automaton::RelevantAtoms(int state) const {
  std::vector<int> atoms;
  std::vector<Target> open{diagram_.roots[state]};
  std::vector<Target> seen;
  while (!open.empty()) {
    const Target target = open.back();
    open.pop_back();
    if (target < 0 || std::find(seen.begin(), seen.end(), target) != seen.end()) continue;
    seen.push_back(target);
    const Diagram::Node& node = diagram_.nodes[target];
    atoms.push_back(node.atom);
    open.push_back(node.low);
    open.push_back(node.high);
  }
  std::sort(atoms.begin(), atoms.end());
  atoms.erase(std::unique(atoms.begin(), atoms.end()), atoms.end());
  return atoms;
}

bool Automaton::IsSatisfiable() const {
  std::vector<Target> open{diagram_.roots[0]};
  while (!open.empty()) {
    const Target target = open.back();
    open.pop_back();
    if (target < 0) {
      if (!IsTrap(~target)) return true;
    } else {
      open.push_back(diagram_.nodes[target].low);
      open.push_back(diagram_.nodes[target].high);
    }
  }
  return false;
}

std::vector<AutomatonEdge> Automaton::Edges(GuardForms forms) const { return FindGuards(diagram_, forms); }

std::vector<std::string> AtomTexts(const std::vector<std::string>& atoms) {
  std::vector<std::string> texts;
  for (const std::string& atom : atoms) texts.push_back(AtomText(atom));
  return texts;
}

std::string GuardText(const AutomatonEdge& edge, const std::vector<std::string>& texts) {
  const auto literals = [](const std::vector<Cube>& cubes) {
    size_t count = 0;
    for (const Cube& cube : cubes) count += cube.literals.size();
    return count;
  };
  const bool sum = edge.has_guard && (!edge.has_clauses || literals(edge.guard) <= literals(edge.clauses));
  const std::vector<Cube>& terms = sum ? edge.guard : edge.clauses;
  std::string text;
  for (const Cube& term : terms) {
    if (!text.empty()) text += sum ? " | " : " & ";
    const bool parentheses = !sum && terms.size() > 1 && term.literals.size() > 1;
    if (parentheses) text += "(";
    for (size_t k = 0; k < term.literals.size(); ++k) {
      const auto& [atom, value] = term.literals[k];
      if (k > 0) text += sum ? " & " : " | ";
      text += (value ? "" : "!") + texts[atom];
    }
    if (parentheses) text += ")";
  }
  return text.empty() ? "true" : text;
}

std::optional<Automaton> BuildAutomaton(const Formula& formula, Semantics semantics,
                                        const DiagramLimits& limits) {
  const Core core(formula, semantics);
  Compiler compiler(core, limits);
  std::optional<Diagram> diagram = compiler.Compile(core.root());
  if (!diagram) return std::nullopt;
  return Automaton(formula.atoms(), *std::move(diagram));
}

}  // namespace tether::ltl
