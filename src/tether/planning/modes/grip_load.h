#pragma once

#include <string>

#include "tether/constraints/grasps/part_grasps.h"
#include "tether/planning/skeleton/action.h"
#include "tether/scene/scene.h"

namespace tether::planning {

/// What a step's fingers are asked to hold when they close on `object`, with what its verbs press.
constraints::Load LoadOf(const scene::Object& object, const StepSchema& step);

}  // namespace tether::planning
