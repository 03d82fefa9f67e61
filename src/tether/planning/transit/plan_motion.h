#pragma once

#include <string>

#include "tether/planning/plan/plan.h"
#include "tether/planning/plan/problem.h"

namespace tether::planning {

/// How planning the arm's motions ended.
struct MotionOutcome {
  bool found = true;    ///< Of every step that has one.
  int step = -1;        ///< Else the first without.
  std::string reason;   ///< Why, as a phrase that can follow the action's name.
  std::string blocker;  ///< What stands in the way, if one object does.
};

/// Plans the arm's motion from key pose to key pose, with what it holds and around everything else, into the
/// steps of `plan`, which must have IK solutions and bound verbs: for each step the transit to its first
/// reach. Where a transit leads only to another branch, the step's IK solution becomes that one. Steps
/// without a key pose end it: what follows them begins nobody knows where. Deterministic.
MotionOutcome PlanMotions(const Problem& problem, Plan* plan);

}  // namespace tether::planning
