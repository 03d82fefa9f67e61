#pragma once

#include <string>

#include "tether/constraints/grasps/part_grasps.h"
#include "tether/planning/skeleton/action.h"
#include "tether/scene/scene.h"

namespace tether::planning {

/// The load on a step's fingers when they close on `object` with the force of its verbs.
constraints::Load LoadOf(const scene::Object& object, const StepSchema& step);

}  // namespace tether::planning
