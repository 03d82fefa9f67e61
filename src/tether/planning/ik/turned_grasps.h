#pragma once

#include <vector>

#include "tether/planning/program/program_builder.h"

namespace tether::planning {

/// A parallel gripper that is turned by half a turn about its approach grasps alike. Where IK solutions of a
/// skeleton have a joint at its limit, or a key pose has none, grasps are turned one after another as far as
/// that helps: in `poses`, with the IK solutions in `key_poses`. Skeletons whose joints are variables of the
/// program stay as they are.
void PreferTurnedGrasps(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                        std::vector<math::Pose>& poses, KeyPoseProgram& key_poses);

}  // namespace tether::planning
