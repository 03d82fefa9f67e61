#pragma once

#include <string>

#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::planning {

/// Whether the hand, pointing straight down, reaches an object at its initial pose: the middle of some part
/// of a movable one, turned along or across it; some point of the upper side of a fixed one. Joints keep a
/// margin to their limits; obstacles do not count. Takes milliseconds.
bool WithinReach(const robot::Model& model, const math::Pose& X_WBase, const scene::Scene& scene,
                 const std::string& object);

}  // namespace tether::planning
