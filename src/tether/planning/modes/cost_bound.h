#pragma once

#include <vector>

#include "tether/planning/program/step_context.h"
#include "tether/planning/skeleton/skeleton_binding.h"

namespace tether::planning {

/// A lower bound on the cost (paper A, eq. (4)) of any key poses of these steps. Where a step ties the hand
/// to something that was not moved, the hand is in a known ball (constraints::Kind::locate); the bound is the
/// cost of the shortest path through these balls, evenly spread over the steps, without turning.
double LowerCostBound(const SceneFacts& facts, const std::vector<BoundStep>& steps);

}  // namespace tether::planning
