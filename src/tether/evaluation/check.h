#pragma once

#include <string>
#include <vector>

#include "tether/scenario/scenario.h"
#include "tether/symbolic/grounding/task.h"

namespace tether::evaluation {

/// The result of checking one file.
struct FileCheck {
  std::string file;
  std::string
      kind;  ///< "scenario", "action library", "events", "plan", "log"; empty if it was not recognised.
  std::vector<std::string> problems;  ///< Where geometry disagrees, or what a plan violates.
  std::vector<std::string> notes;     ///< Facts for the user that are no problems.
};

/// Contradictions in the scene's geometry and between it and the PDDL initial state: solids that overlap by
/// more than 1 mm, movable objects that hang in the air, facts on(a, b) without contact, and contacts without
/// such a fact.
std::vector<std::string> CheckGeometry(const scenario::Scenario& scenario);

/// Arms that start inside of something: objects, other arms, themselves; and bases that stand in something.
std::vector<std::string> CheckArms(const scenario::Scenario& scenario);

/// Checks files in formats `tether.scenario/1`, `tether.actions/1`, `tether.events/1` and `tether.plan/1`,
/// and logs of runs (`tether.log/2`), whose runs are judged again. A plan is judged by the independent
/// checker, with the scenario among `files` that has its title, else with the one that it names. Files with
/// mistakes are left out of what is returned; the mistakes go to `diagnostics`.
std::vector<FileCheck> CheckFiles(const std::vector<std::string>& files, Diagnostics& diagnostics);

/// The same, but throws InputError with the mistakes of all files if there are any.
std::vector<FileCheck> CheckFiles(const std::vector<std::string>& files);

}  // namespace tether::evaluation
