#pragma once

#include <string>

#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::planning {

/// Whether the arm gets its hand, pointing straight down, to an object where it stands at the start: of a
/// movable one to the middle of some part, turned along or across it; of a fixed one to some point of its
/// upper side. Joints keep within their limits by a margin; what stands around does not count. Milliseconds.
bool WithinReach(const robot::Model& model, const math::Pose& X_WBase, const scene::Scene& scene,
                 const std::string& object);

}  // namespace tether::planning
