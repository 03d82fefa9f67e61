#pragma once

#include <map>
#include <memory>
#include <string>

#include "tether/common/document/value.h"
#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::evaluation {

/// A foxglove.SceneUpdate with everything to be seen of a scene: objects, regions and the robots' solids,
/// each in its own frame, so that transforms alone move them. Frames of a robot: "robot/link3", "robot/hand".
Value SceneEntities(const scene::Scene& scene,
                    const std::map<std::string, std::shared_ptr<const robot::Model>>& models);

/// The names of a robot's frames in transforms.
std::string LinkFrame(const std::string& robot, int link);
std::string HandFrame(const std::string& robot);

}  // namespace tether::evaluation
