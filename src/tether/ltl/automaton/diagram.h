#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace tether::ltl {

/// Where a transition leads: ≥ 0, a node of the diagram; < 0, the state ~target.
using Target = int;

/// A complete deterministic automaton on letters that are sets of atoms, its transition functions as shared
/// decision diagrams with states at the leaves, as MONA represents them (Henriksen et al., 1995): the number
/// of letters does not matter.
struct Diagram {
  struct Node {
    int atom = 0;  ///< Tested in increasing order along a path.
    Target low = 0;
    Target high = 0;
  };

  std::vector<Node> nodes;      ///< Branches before the nodes that lead to them.
  std::vector<Target> roots;    ///< Per state.
  std::vector<bool> accepting;  ///< Per state.
  int initial = 0;

  size_t states() const { return roots.size(); }
};

struct DiagramLimits {
  size_t max_states = 1'000'000;
  size_t max_nodes = 8'000'000;  ///< Of a diagram.
};

/// The automaton of the words that both accept; empty if it would exceed the limits.
std::optional<Diagram> Intersect(const Diagram& a, const Diagram& b, const DiagramLimits& limits);

/// The automaton of the complement language.
Diagram Complement(Diagram diagram);

/// The minimal automaton of the same language, states numbered breadth first from the initial one, which is
/// 0: equal languages over the same atoms give equal diagrams. Refines partitions as Moore does, one pass
/// over the shared nodes per round. All states must be reachable.
Diagram Minimize(const Diagram& diagram);

}  // namespace tether::ltl
