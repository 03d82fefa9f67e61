#pragma once

#include <string>
#include <vector>

#include "tether/planning/plan/plan.h"
#include "tether/planning/plan/problem.h"
#include "tether/planning/program/step_context.h"
#include "tether/planning/skeleton/skeleton_binding.h"

namespace tether::planning {

/// A constraint that a plan violates, or would violate with a smaller tolerance.
struct CheckFinding {
  int step = 0;
  std::string action;
  std::string label;  ///< "clearance(hand, table)"
  nlp::Unit unit = nlp::Unit::kMetre;
  double amount = 0;       ///< Violation, m or rad, > 0.
  std::string cause = {};  ///< What is wrong, as a phrase that can follow the action's name; may be empty.
};

/// The judgement of a plan.
struct CheckResult {
  double max_violation_m = 0;
  double max_violation_rad = 0;
  double cost = 0;                     ///< Paper A, eq. (4).
  std::vector<CheckFinding> findings;  ///< Every violation above 1e-6, largest first.
  std::vector<math::Pose> X_WHand;     ///< The hand at each key pose.

  /// Every violation is within the tolerances of the options.
  bool Feasible(const ProgramOptions& options) const {
    return max_violation_m <= options.feasible_m && max_violation_rad <= options.feasible_rad;
  }
  /// The worst finding in words, or empty.
  std::string Worst() const;
};

/// Judges a plan by geometry alone: poses are composed step by step, each constraint's own geometric test is
/// made, and every pair of solids that should be apart is measured. Shares no code with the rows of the
/// optimiser. Throws InputError if the plan's actions and steps don't belong together.
CheckResult CheckPlan(const Problem& problem, const Plan& plan);
/// The same for a bound skeleton and the poses of its steps' control frames in their targets; no target may
/// be attached to its control frame. `q` are the IK solutions of the key poses, which are judged too; where
/// there are none, reachability is not judged.
CheckResult CheckKeyPoses(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                          const std::vector<math::Pose>& poses, const std::vector<Eigen::VectorXd>& q = {});

}  // namespace tether::planning
