#pragma once

#include <string>
#include <vector>

#include "tether/planning/ik/ik_search.h"
#include "tether/planning/skeleton/skeleton_binding.h"

namespace tether::planning {

/// Checks the approach to a key pose (from the last reach before it) and the retreat from it (the shifts
/// after it), for a push also the straight motion from the key pose before, by samples: the arm follows them
/// from the IK solution without leaving its branch, with links, hand and the held object clear of what the
/// key pose itself keeps clear of. Empty if they are free; else why not, as a phrase that can follow the
/// action's name: "on the way there, panda's link5 would be 1.2 cm inside shelf".
///
/// Where they are not free from `ik_solution`, but are with the elbow elsewhere, `ik_solution` becomes that
/// one. `search` is that of the skeleton; `ik_solution` is that of the step, and was found.
std::string CheckApproaches(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                            const FrameTree& tree, const std::vector<math::Pose>& poses, int step,
                            IkSearch& search, IkSolution& ik_solution);

}  // namespace tether::planning
