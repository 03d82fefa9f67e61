#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tether/planning/plan/limits.h"
#include "tether/planning/plan/plan.h"
#include "tether/planning/plan/problem.h"

namespace tether::planning {

/// How planning the arm's motions ended.
struct MotionOutcome {
  bool found = true;   ///< Of every step that has one.
  int step = -1;       ///< Else the first without.
  std::string reason;  ///< Why, as a phrase that can follow the action's name.
  /// Movable objects that stand in the way: without them there is a motion. Empty: it is not they.
  std::vector<std::string> blockers;
  std::optional<Limit> reached = {};  ///< The limit that ended it before it was known, if one did.
};

/// Plans the arm's motion from key pose to key pose, with what it holds and around everything else, into the
/// steps of `plan`, which must have IK solutions and bound verbs: for each step the transit to its first
/// reach. Where a transit leads only to another branch, the step's IK solution becomes that one. Steps
/// without a key pose end it: what follows them begins nobody knows where. Deterministic but for the limits;
/// a time limit that the search used up is extended by a tenth, for a plan without motions is of no use.
MotionOutcome PlanMotions(const Problem& problem, const Limits& limits, Plan* plan);

}  // namespace tether::planning
