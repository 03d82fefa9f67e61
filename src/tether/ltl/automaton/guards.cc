#include "tether/ltl/automaton/guards.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "tether/common/limits.h"
#include "tether/ltl/automaton/bdd.h"

namespace tether::ltl {
namespace {

/// Target states with the conditions to get there, by state.
using Conditions = std::vector<std::pair<int, Bdd::Ref>>;

/// A form of a guard with more cubes than this is left out.
constexpr size_t kMostCubes = 4096;

class GuardFinder {
 public:
  GuardFinder(const Diagram& diagram, GuardForms forms)
      : diagram_(diagram), forms_(forms), of_node_(diagram.nodes.size()) {}

  std::vector<AutomatonEdge> Run() {
    for (size_t i = 0; i < of_node_.size(); ++i) of_node_[i] = Branch(diagram_.nodes[i]);
    std::vector<AutomatonEdge> edges;
    for (size_t s = 0; s < diagram_.states(); ++s) {
      for (const auto& [to, condition] : Of(diagram_.roots[s])) {
        AutomatonEdge edge;
        edge.from = static_cast<int>(s);
        edge.to = to;
        // One form of n disjoint pairs has 2^n cubes where the other has n.
        edge.has_guard = Cover(condition, kMostCubes, edge.guard);
        edge.has_clauses = Cover(Bdd::Not(condition), kMostCubes, edge.clauses);
        if (!edge.has_guard && !edge.has_clauses && forms_ == GuardForms::kAtLeastOne)
          edge.has_guard = Cover(condition, std::numeric_limits<size_t>::max(), edge.guard);
        Negate(edge.clauses);
        edges.push_back(std::move(edge));
      }
    }
    return edges;
  }

 private:
  Conditions Of(Target target) const {
    return target < 0 ? Conditions{{~target, Bdd::kTrue}} : of_node_[target];
  }

  Conditions Branch(const Diagram::Node& node) {
    const Conditions low = Of(node.low), high = Of(node.high);
    Conditions both;
    for (size_t i = 0, j = 0; i < low.size() || j < high.size();) {
      const bool take_low = j == high.size() || (i < low.size() && low[i].first <= high[j].first);
      const bool take_high = i == low.size() || (j < high.size() && high[j].first <= low[i].first);
      const int state = take_low ? low[i].first : high[j].first;
      both.emplace_back(state, bdd_.MakeNode(node.atom, take_low ? low[i].second : Bdd::kFalse,
                                             take_high ? high[j].second : Bdd::kFalse));
      i += take_low ? 1 : 0;
      j += take_high ? 1 : 0;
    }
    return both;
  }

  static void Negate(std::vector<Cube>& cubes) {
    for (Cube& cube : cubes) {
      for (auto& literal : cube.literals) literal.second = !literal.second;
    }
  }

  /// False, and none, if more than `most` are needed.
  bool Cover(Bdd::Ref condition, size_t most, std::vector<Cube>& cubes) {
    std::vector<std::pair<int, bool>> prefix;
    most_ = most;
    try {
      Cover(condition, condition, prefix, cubes);
    } catch (const TooMany&) {
      cubes.clear();
      cubes.shrink_to_fit();
      return false;
    }
    for (Cube& cube : cubes) std::sort(cube.literals.begin(), cube.literals.end());
    return true;
  }

  /// Appends cubes that cover `lower` within `upper`, each with the literals of `prefix`; returns what they
  /// cover (without `prefix`). Minato's recursion.
  Bdd::Ref Cover(Bdd::Ref lower, Bdd::Ref upper, std::vector<std::pair<int, bool>>& prefix,
                 std::vector<Cube>& cubes) {
    if (lower == Bdd::kFalse) return Bdd::kFalse;
    PollLimits();
    if (upper == Bdd::kTrue) {
      if (cubes.size() >= most_) throw TooMany{};
      cubes.push_back({prefix});
      return Bdd::kTrue;
    }
    const int atom = std::min(bdd_.Level(lower), bdd_.Level(upper));
    const auto low = [&](Bdd::Ref f) { return bdd_.Level(f) == atom ? bdd_.Low(f) : f; };
    const auto high = [&](Bdd::Ref f) { return bdd_.Level(f) == atom ? bdd_.High(f) : f; };
    const Bdd::Ref lower0 = low(lower), lower1 = high(lower), upper0 = low(upper), upper1 = high(upper);
    prefix.emplace_back(atom, true);
    const Bdd::Ref cover1 = Cover(bdd_.And(lower1, Bdd::Not(upper0)), upper1, prefix, cubes);
    prefix.back().second = false;
    const Bdd::Ref cover0 = Cover(bdd_.And(lower0, Bdd::Not(upper1)), upper0, prefix, cubes);
    prefix.pop_back();
    const Bdd::Ref rest = bdd_.Or(bdd_.And(lower0, Bdd::Not(cover0)), bdd_.And(lower1, Bdd::Not(cover1)));
    const Bdd::Ref cover = Cover(rest, bdd_.And(upper0, upper1), prefix, cubes);
    return bdd_.Or(cover, bdd_.MakeNode(atom, cover0, cover1));
  }

  struct TooMany {};

  const Diagram& diagram_;
  GuardForms forms_;
  size_t most_ = 0;
  Bdd bdd_;
  std::vector<Conditions> of_node_;
};

}  // namespace

std::vector<AutomatonEdge> FindGuards(const Diagram& diagram, GuardForms forms) {
  return GuardFinder(diagram, forms).Run();
}

}  // namespace tether::ltl
