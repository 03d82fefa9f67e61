#pragma once

#include <map>
#include <string>

#include "tether/common/document/value.h"
#include "tether/common/error.h"
#include "tether/scenario/scenario.h"
#include "tether/scenario/scenario_reading.h"

/// Reads the task of a scenario; not for users of the room.
namespace tether::scenario {

/// What the task refers to besides the scene, which is read before it.
struct TaskSurroundings {
  const ScenarioFiles& files;
  const std::map<std::string, Location>& where;  ///< Where the scene's names were written.
  bool has_actions = false;                      ///< There is a list of action libraries.
  bool libraries_read = true;                    ///< None of those named is missing or broken.
};

/// Sets `task`, `problem` and `goal` of the scenario, whose scene and actions are read: PDDL files or the
/// domain of regions, and a goal in PDDL or as a temporal formula. Mistakes go to `diagnostics`.
void ReadTask(const Value& value, const TaskSurroundings& surroundings, Scenario& scenario,
              Diagnostics& diagnostics);

/// Adds to the problem's initial state what the arm reaches, for the predicates of the task's `within_reach`,
/// which is `value`. Mistakes go to `diagnostics`.
void StateReach(const Value& value, Scenario& scenario, Diagnostics& diagnostics);

}  // namespace tether::scenario
