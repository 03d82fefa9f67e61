#include "tether/ltl/automaton/diagram.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "tether/common/limits.h"
#include "tether/ltl/automaton/triple_map.h"

namespace tether::ltl {
namespace {

struct TooLarge {};

/// Pairs of states, reached from the pair of initial ones.
class Product {
 public:
  Product(const Diagram& a, const Diagram& b, const DiagramLimits& limits)
      : a_(a), b_(b), limits_(limits), hopeless_a_(HopelessSinks(a)), hopeless_b_(HopelessSinks(b)) {}

  Diagram Run() {
    StateOf(a_.initial, b_.initial);
    for (size_t i = 0; i < pairs_.size(); ++i) {
      const auto [p, q] = pairs_[i];
      const int self = static_cast<int>(i);
      if (p < 0) {
        result_.roots[i] = ~self;
      } else {
        const Target root = Apply(a_.roots[p], b_.roots[q]);
        result_.roots[i] = root;
      }
    }
    return std::move(result_);
  }

 private:
  /// States that reject and are never left.
  static std::vector<bool> HopelessSinks(const Diagram& diagram) {
    std::vector<bool> sinks(diagram.states());
    for (size_t s = 0; s < sinks.size(); ++s) {
      sinks[s] = !diagram.accepting[s] && diagram.roots[s] == ~static_cast<int>(s);
    }
    return sinks;
  }

  bool IsHopeless(Target x, const std::vector<bool>& hopeless) const { return x < 0 && hopeless[~x]; }

  int StateOf(int p, int q) {
    const auto fresh = static_cast<uint32_t>(pairs_.size());
    const uint32_t state = states_.FindOrInsert(static_cast<uint32_t>(p), static_cast<uint32_t>(q), 0, fresh);
    if (state == fresh) {
      if (pairs_.size() >= limits_.max_states) throw TooLarge{};
      PollLimits();
      pairs_.emplace_back(p, q);
      result_.roots.push_back(0);
      result_.accepting.push_back(p >= 0 && a_.accepting[p] && b_.accepting[q]);
    }
    return static_cast<int>(state);
  }

  Target Apply(Target x, Target y) {
    // All pairs with a state that is lost are the one that stands for them.
    if (IsHopeless(x, hopeless_a_) || IsHopeless(y, hopeless_b_)) return ~StateOf(-1, -1);
    if (x < 0 && y < 0) return ~StateOf(~x, ~y);
    const auto key_x = static_cast<uint32_t>(x), key_y = static_cast<uint32_t>(y);
    const uint32_t cached = cache_.Find(key_x, key_y, 0);
    if (cached != TripleMap::kNone) return static_cast<Target>(cached - kOffset);
    const Diagram::Node here_x = x < 0 ? Diagram::Node{kNoAtom, x, x} : a_.nodes[x];
    const Diagram::Node here_y = y < 0 ? Diagram::Node{kNoAtom, y, y} : b_.nodes[y];
    const int atom = std::min(here_x.atom, here_y.atom);
    const bool step_x = here_x.atom == atom, step_y = here_y.atom == atom;
    const Target low = Apply(step_x ? here_x.low : x, step_y ? here_y.low : y);
    const Target high = Apply(step_x ? here_x.high : x, step_y ? here_y.high : y);
    Target result = low;
    if (low != high) {
      if (result_.nodes.size() >= limits_.max_nodes) throw TooLarge{};
      PollLimits();
      result = static_cast<Target>(result_.nodes.size());
      result_.nodes.push_back({atom, low, high});
    }
    cache_.FindOrInsert(key_x, key_y, 0, static_cast<uint32_t>(result) + kOffset);
    return result;
  }

  static constexpr int kNoAtom = 0x7fffffff;
  /// Keeps targets, the negative ones too, away from TripleMap::kNone.
  static constexpr uint32_t kOffset = 0x80000000u;

  const Diagram& a_;
  const Diagram& b_;
  DiagramLimits limits_;
  std::vector<bool> hopeless_a_, hopeless_b_;
  std::vector<std::pair<int, int>> pairs_;
  TripleMap states_;
  TripleMap cache_;
  Diagram result_;
};

/// Numbers states in breadth-first order.
std::vector<int> BreadthFirstOrder(const Diagram& diagram) {
  std::vector<int> number(diagram.states(), -1);
  std::vector<int> queue{diagram.initial};
  number[diagram.initial] = 0;
  std::vector<bool> seen(diagram.nodes.size());
  std::vector<Target> open;
  for (size_t i = 0; i < queue.size(); ++i) {
    open.push_back(diagram.roots[queue[i]]);
    while (!open.empty()) {
      const Target target = open.back();
      open.pop_back();
      if (target < 0) {
        int& place = number[~target];
        if (place >= 0) continue;
        place = static_cast<int>(queue.size());
        queue.push_back(~target);
      } else if (!seen[target]) {
        seen[target] = true;
        open.push_back(diagram.nodes[target].high);
        open.push_back(diagram.nodes[target].low);
      }
    }
  }
  return number;
}

/// The diagram with its states renumbered.
Diagram Renumber(const Diagram& diagram, const std::vector<int>& number) {
  const auto renamed = [&](Target t) { return t < 0 ? ~number[~t] : t; };
  Diagram result;
  result.nodes = diagram.nodes;
  for (Diagram::Node& node : result.nodes) node = {node.atom, renamed(node.low), renamed(node.high)};
  result.roots.resize(diagram.states());
  result.accepting.resize(diagram.states());
  for (size_t s = 0; s < diagram.states(); ++s) {
    const auto to = static_cast<size_t>(number[s]);
    result.roots[to] = renamed(diagram.roots[s]);
    result.accepting[to] = diagram.accepting[s];
  }
  result.initial = number[diagram.initial];
  return result;
}

/// Partition refinement. A round maps each node to the node that it is when states of one class are one leaf.
class Refinement {
 public:
  explicit Refinement(const Diagram& diagram)
      : diagram_(diagram),
        class_of_(diagram.states()),
        image_(diagram.nodes.size()),
        unique_(diagram.nodes.size()),
        classes_by_key_(diagram.states()) {
    for (size_t s = 0; s < class_of_.size(); ++s) class_of_[s] = ClassOf(diagram.accepting[s] ? 1 : 0, 0);
  }

  Diagram Run() {
    for (size_t before = 0; before != classes_by_key_.size();) {
      before = classes_by_key_.size();
      MapNodes();
      classes_by_key_.Clear();
      // Not in place: a root that is a leaf must see the old classes.
      std::vector<int> refined(class_of_.size());
      for (size_t s = 0; s < refined.size(); ++s)
        refined[s] = ClassOf(class_of_[s], Image(diagram_.roots[s]));
      class_of_.swap(refined);
    }
    Diagram result;
    result.nodes = std::move(nodes_);
    result.roots.resize(classes_by_key_.size());
    result.accepting.resize(classes_by_key_.size());
    for (size_t s = class_of_.size(); s-- > 0;) {
      const auto c = static_cast<size_t>(class_of_[s]);
      result.roots[c] = Image(diagram_.roots[s]);
      result.accepting[c] = diagram_.accepting[s];
    }
    result.initial = class_of_[diagram_.initial];
    return result;
  }

 private:
  /// Classes are numbered in the order of their first states: the same partition has the same numbers.
  int ClassOf(int old_class, Target root) {
    const auto fresh = static_cast<uint32_t>(classes_by_key_.size());
    return static_cast<int>(classes_by_key_.FindOrInsert(static_cast<uint32_t>(old_class),
                                                         static_cast<uint32_t>(root), 0, fresh));
  }

  Target Image(Target t) const { return t < 0 ? ~class_of_[~t] : image_[t]; }

  void MapNodes() {
    nodes_.clear();
    unique_.Clear();
    for (size_t i = 0; i < diagram_.nodes.size(); ++i) {
      const Diagram::Node& node = diagram_.nodes[i];
      if (i % 64 == 0) PollLimits();
      const Target low = Image(node.low), high = Image(node.high);
      if (low == high) {
        image_[i] = low;
        continue;
      }
      const auto fresh = static_cast<uint32_t>(nodes_.size());
      const uint32_t place = unique_.FindOrInsert(
          static_cast<uint32_t>(node.atom), static_cast<uint32_t>(low), static_cast<uint32_t>(high), fresh);
      if (place == fresh) nodes_.push_back({node.atom, low, high});
      image_[i] = static_cast<Target>(place);
    }
  }

  const Diagram& diagram_;
  std::vector<int> class_of_;
  std::vector<Target> image_;
  std::vector<Diagram::Node> nodes_;
  TripleMap unique_;
  TripleMap classes_by_key_;
};

}  // namespace

std::optional<Diagram> Intersect(const Diagram& a, const Diagram& b, const DiagramLimits& limits) {
  try {
    return Product(a, b, limits).Run();
  } catch (const TooLarge&) {
    return std::nullopt;
  }
}

Diagram Complement(Diagram diagram) {
  diagram.accepting.flip();
  return diagram;
}

Diagram Minimize(const Diagram& diagram) {
  const Diagram merged = Refinement(diagram).Run();
  return Renumber(merged, BreadthFirstOrder(merged));
}

}  // namespace tether::ltl
