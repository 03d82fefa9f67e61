#pragma once

#include <string>
#include <vector>

#include "tether/planning/ik/ik_search.h"
#include "tether/planning/skeleton/skeleton_binding.h"

namespace tether::planning {

/// The straight motions about a key pose as its verbs ask for them: from the last reach before it to the key
/// pose, and by the shifts after it; of a push also the stretch from the key pose before. Sampled: the arm
/// follows them from the witness without leaving its branch, links, hand and what it holds clear of what the
/// key pose itself keeps clear of. Empty if so; else why not, in words that follow the action: "on the way
/// there, panda's link5 would be 1.2 cm inside shelf".
///
/// Where they are not free from the witness, but are with the elbow elsewhere, the witness becomes that.
/// `search` is that of the skeleton; `witness` is that of the step, and was found.
std::string CheckApproaches(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                            const FrameTree& tree, const std::vector<math::Pose>& poses, int step,
                            IkSearch& search, IkSolution& ik_solution);

}  // namespace tether::planning
