#include "tether/planning/ways.h"

#include <algorithm>
#include <set>
#include <utility>

#include "tether/planning/hand_path.h"

namespace tether::planning {
namespace {

// A way is promising if at its guess turning the hand is no more than this share of the cost, and nothing is
// further out of reach than this, m.
constexpr double kMuchTurning = 0.3;
constexpr double kFarOutOfReach = 0.02;
// What being out of reach at the guess counts against a way, per m.
constexpr double kReachWeight = 10;

struct Sketch {
  Way way;
  std::vector<ChoicePoint> choices;
};

/// The ways that differ in one choice, taken one option further; the likeliest first.
std::vector<Variant> Neighbours(const Sketch& sketch) {
  std::vector<std::pair<double, Variant>> neighbours;
  for (const ChoicePoint& choice : sketch.choices) {
    const size_t next = static_cast<size_t>(choice.chosen) + 1;
    if (next >= choice.options.size()) continue;
    Variant variant = sketch.way.variant;
    variant[choice.key] = static_cast<int>(next);
    neighbours.emplace_back(choice.options[next].score - choice.options[next - 1].score, std::move(variant));
  }
  std::stable_sort(neighbours.begin(), neighbours.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Variant> variants;
  for (auto& [score, variant] : neighbours) variants.push_back(std::move(variant));
  return variants;
}

}  // namespace

Way DescribeWay(const SceneFacts& facts, const Variant& variant, const KeyPoseProgram& key_poses) {
  Way way{variant, 0, false, key_poses.refutations, key_poses.refuted_action};
  if (!way.refutations.empty()) return way;
  const Problem& problem = facts.problem();
  std::vector<math::Pose> X_WHand;
  double out_of_reach = 0;
  for (int t = 0; t < key_poses.tree.num_steps(); ++t) {
    X_WHand.push_back(key_poses.tree.PoseAt(constraints::kHand, t, key_poses.guess.poses));
    if (problem.robot.model != nullptr)
      out_of_reach = std::max(out_of_reach, OutOfReach(problem.robot, X_WHand.back()));
  }
  const HandCost cost = CostOfHand(problem, X_WHand);
  way.promise = cost.total() + kReachWeight * out_of_reach;
  way.promising = cost.turn <= kMuchTurning * cost.total() && out_of_reach <= kFarOutOfReach;
  return way;
}

Ways FindWays(const SceneFacts& facts, const std::vector<BoundStep>& steps, size_t most) {
  Ways ways;
  std::vector<Sketch> sketches;
  std::set<Variant> seen;
  std::set<std::pair<double, size_t>> frontier;  // promise and index of those whose neighbours were not met
  const auto meet = [&](const Variant& variant) {
    if (!seen.insert(variant).second) return;
    const KeyPoseProgram guessed = BuildProgram(facts, steps, variant, {.guess_only = true});
    Sketch sketch{DescribeWay(facts, variant, guessed), guessed.choices};
    (sketch.way.refutations.empty() ? ways.open : ways.refuted).push_back(sketch.way);
    // Of refuted ways, those with fewer changes come first.
    double rank = sketch.way.promise;
    if (!sketch.way.refutations.empty()) rank = 1e6 + static_cast<double>(variant.size());
    frontier.emplace(rank, sketches.size());
    sketches.push_back(std::move(sketch));
  };
  meet({});
  while (!frontier.empty() && sketches.size() < most) {
    if (!ways.refuted.empty() && ways.refuted.back().refuted_action >= 0) break;
    const size_t best = frontier.extract(frontier.begin()).value().second;
    for (const Variant& variant : Neighbours(sketches[best])) {
      if (sketches.size() < most) meet(variant);
    }
  }
  ways.exhausted = frontier.empty();
  std::stable_sort(ways.open.begin(), ways.open.end(),
                   [](const Way& a, const Way& b) { return a.promise < b.promise; });
  return ways;
}

}  // namespace tether::planning
