#include "tether/planning/modes/mode_assignment.h"

#include <algorithm>
#include <set>
#include <utility>

#include "tether/planning/modes/hand_path.h"

namespace tether::planning {
namespace {

// A mode assignment is likely to be the best one if at its guess turning the hand is no more than this share
// of the cost, and nothing is further out of reach than this, m.
constexpr double kMuchTurning = 0.3;
constexpr double kFarOutOfReach = 0.02;
// The penalty of a guess out of reach, per m.
constexpr double kReachWeight = 10;
// Alternatives: options whose score is worse by no more than this, and whose predicted cost is higher by no
// more than such a factor.
constexpr double kAlternativeScore = 0.5;
constexpr double kAlternativeCost = 1.2;

/// The variants that differ in one choice, by its next option; the likeliest first.
std::vector<Variant> Neighbours(const ModeAssignment& modes) {
  std::vector<std::pair<double, Variant>> neighbours;
  for (const ChoicePoint& choice : modes.choices) {
    const size_t next = ToIndex(choice.chosen) + 1;
    if (next >= choice.options.size()) continue;
    Variant variant = modes.variant;
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

ModeAssignment DescribeModeAssignment(const SceneFacts& facts, const Variant& variant,
                                      const KeyPoseProgram& key_poses) {
  ModeAssignment modes{variant,
                       key_poses.choices,
                       0,
                       false,
                       key_poses.refutations,
                       key_poses.refuted_action,
                       key_poses.refuted_reason,
                       key_poses.refuted_proved,
                       key_poses.refuted_anywhere,
                       key_poses.constant_proof};
  if (!modes.refutations.empty()) return modes;
  const Problem& problem = facts.problem();
  std::vector<math::Pose> X_WHand;
  double out_of_reach = 0;
  for (int t = 0; t < key_poses.tree.num_steps(); ++t) {
    X_WHand.push_back(key_poses.tree.PoseAt(facts.hand(), t, key_poses.guess.poses));
    if (problem.robot.model != nullptr)
      out_of_reach = std::max(out_of_reach, OutOfReach(problem.robot, X_WHand.back()));
  }
  const HandCost cost = CostOfHand(problem, X_WHand);
  modes.predicted_cost = cost.total() + kReachWeight * out_of_reach;
  modes.likely_best = cost.turn <= kMuchTurning * cost.total() && out_of_reach <= kFarOutOfReach;
  return modes;
}

Variant FirstChoices(const ModeAssignment& modes, size_t actions) {
  Variant variant;
  for (const ChoicePoint& choice : modes.choices) {
    if (choice.action < static_cast<int>(actions) && choice.chosen != 0) variant[choice.key] = choice.chosen;
  }
  return variant;
}

ModeAssignments FindModeAssignments(const SceneFacts& facts, const std::vector<BoundStep>& steps, size_t most,
                                    const Limits& limits) {
  ModeAssignments assignments;
  std::vector<ModeAssignment> met;
  std::set<Variant> seen;
  std::set<std::pair<double, size_t>>
      frontier;  // predicted cost and index of those whose neighbours were not examined
  const auto meet = [&](const Variant& variant) {
    if (!seen.insert(variant).second) return;
    const KeyPoseProgram guessed = BuildProgram(facts, steps, variant, {.guess_only = true});
    ModeAssignment modes = DescribeModeAssignment(facts, variant, guessed);
    (modes.refutations.empty() ? assignments.open : assignments.refuted).push_back(modes);
    // Of refuted ones, those with fewer changes come first.
    const double rank =
        modes.refutations.empty() ? modes.predicted_cost : 1e6 + static_cast<double>(variant.size());
    frontier.emplace(rank, met.size());
    met.push_back(std::move(modes));
  };
  meet({});
  while (!frontier.empty() && met.size() < most && !limits.Over()) {
    if (!assignments.refuted.empty() && assignments.refuted.back().refuted_action >= 0) break;
    const size_t best = frontier.extract(frontier.begin()).value().second;
    for (const Variant& variant : Neighbours(met[best])) {
      if (met.size() < most && !limits.Over()) meet(variant);
    }
  }
  std::stable_sort(
      assignments.open.begin(), assignments.open.end(),
      [](const ModeAssignment& a, const ModeAssignment& b) { return a.predicted_cost < b.predicted_cost; });
  return assignments;
}

std::vector<ModeAssignment> FindAlternatives(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                                             const ModeAssignment& modes, const Limits& limits) {
  std::vector<ModeAssignment> alternatives;
  for (const ChoicePoint& choice : modes.choices) {
    const double score = choice.options[ToIndex(choice.chosen)].score;
    for (int option = 0; option < static_cast<int>(choice.options.size()); ++option) {
      const double worse = choice.options[ToIndex(option)].score - score;
      if (option == choice.chosen || worse > kAlternativeScore || limits.Over()) continue;
      Variant variant = modes.variant;
      variant[choice.key] = option;
      ModeAssignment alternative =
          DescribeModeAssignment(facts, variant, BuildProgram(facts, steps, variant, {.guess_only = true}));
      if (alternative.refutations.empty() &&
          alternative.predicted_cost <= kAlternativeCost * modes.predicted_cost)
        alternatives.push_back(std::move(alternative));
    }
  }
  std::stable_sort(
      alternatives.begin(), alternatives.end(),
      [](const ModeAssignment& a, const ModeAssignment& b) { return a.predicted_cost < b.predicted_cost; });
  return alternatives;
}

}  // namespace tether::planning
