#include "tether/ltl/guards.h"

#include <algorithm>
#include <utility>

#include "tether/ltl/bdd.h"

namespace tether::ltl {
namespace {

/// Target states with the conditions to get there, by state.
using Conditions = std::vector<std::pair<int, Bdd::Ref>>;

class GuardFinder {
 public:
  explicit GuardFinder(const Diagram& diagram) : diagram_(diagram), of_node_(diagram.nodes.size()) {}

  std::vector<AutomatonEdge> Run() {
    for (size_t i = 0; i < of_node_.size(); ++i) of_node_[i] = Branch(diagram_.nodes[i]);
    std::vector<AutomatonEdge> edges;
    for (size_t s = 0; s < diagram_.states(); ++s) {
      for (const auto& [to, condition] : Of(diagram_.roots[s])) {
        edges.push_back({static_cast<int>(s), to, Cover(condition), Negate(Cover(Bdd::Not(condition)))});
      }
    }
    return edges;
  }

 private:
  Conditions Of(Target target) const {
    return target < 0 ? Conditions{{~target, Bdd::kTrue}} : of_node_[static_cast<size_t>(target)];
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

  static std::vector<Cube> Negate(std::vector<Cube> cubes) {
    for (Cube& cube : cubes) {
      for (auto& literal : cube.literals) literal.second = !literal.second;
    }
    return cubes;
  }

  std::vector<Cube> Cover(Bdd::Ref condition) {
    std::vector<Cube> cubes;
    std::vector<std::pair<int, bool>> prefix;
    Cover(condition, condition, prefix, cubes);
    for (Cube& cube : cubes) std::sort(cube.literals.begin(), cube.literals.end());
    return cubes;
  }

  /// Appends cubes that cover `lower` within `upper`, each with the literals of `prefix`; returns what they
  /// cover (without `prefix`). Minato's recursion.
  Bdd::Ref Cover(Bdd::Ref lower, Bdd::Ref upper, std::vector<std::pair<int, bool>>& prefix,
                 std::vector<Cube>& cubes) {
    if (lower == Bdd::kFalse) return Bdd::kFalse;
    if (upper == Bdd::kTrue) {
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

  const Diagram& diagram_;
  Bdd bdd_;
  std::vector<Conditions> of_node_;
};

}  // namespace

std::vector<AutomatonEdge> FindGuards(const Diagram& diagram) { return GuardFinder(diagram).Run(); }

}  // namespace tether::ltl
