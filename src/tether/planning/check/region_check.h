#pragma once

#include <string>
#include <vector>

#include "tether/planning/plan/candidate.h"

namespace tether::planning {

/// Whether some step of the action has a region for a target: any pose in it will do (paper B, section 3.2).
bool HasRegionStep(const ActionSchema& action);
/// The same for bound steps.
bool HasRegionStep(const std::vector<BoundStep>& steps);

/// Necessary conditions of a candidate with steps to regions, whose poses are left to the controller: an
/// object must fit into the regions that it is brought to, these must be within the arm's reach, and actions
/// without such steps must have key poses by themselves, from the poses at the start. The plan's cost is left
/// at 0.
///
/// An action that fails does so whatever comes before it: Verdict::failing_anywhere.
Verdict CheckRegionSteps(const SceneFacts& facts, const Skeleton& skeleton, int index, const Limits& limits);

}  // namespace tether::planning
