#include "tether/planning/modes/grip_load.h"

#include <algorithm>
#include <variant>

namespace tether::planning {

constraints::Load LoadOf(const scene::Object& object, const StepSchema& step) {
  constraints::Load load;
  load.mass = object.mass.value_or(0);
  load.friction = object.friction;
  for (const Verb& verb : step.execute) {
    const auto* gripper = std::get_if<GripperVerb>(&verb);
    if (gripper != nullptr && gripper->close_on == object.name)
      load.force = std::max(load.force.value_or(0), gripper->force);
  }
  return load;
}

}  // namespace tether::planning
