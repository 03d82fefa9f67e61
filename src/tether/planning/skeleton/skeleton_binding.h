#pragma once

#include <string>
#include <vector>

#include "tether/constraints/core/kind.h"
#include "tether/planning/plan/problem.h"

namespace tether::planning {

/// A constraint of a step, ready to be built or judged.
struct BoundConstraint {
  const constraints::Kind* kind = nullptr;
  constraints::Parameters parameters;
};

/// One key pose of a skeleton with all names bound.
struct BoundStep {
  std::string action;  ///< "push(hook,box,table)"
  int action_index = 0;
  int step_in_action = 0;
  StepSchema schema;
  std::vector<BoundConstraint> constraints;  ///< Its own, then those that hold at every step.
};

/// An action of a skeleton: its name and arguments.
struct ActionCall {
  std::string name;
  std::vector<std::string> arguments;
};

/// Splits "push(hook,box,table)".
ActionCall ParseActionCall(const std::string& text);
/// The inverse of ParseActionCall.
std::string ToString(const ActionCall& call);

/// The key poses of a sequence of actions. Throws InputError for an action without geometry, a frame that is
/// not in the scene, or parameters that do not suit a constraint.
std::vector<BoundStep> BindSkeleton(const Problem& problem, const std::vector<std::string>& actions);

}  // namespace tether::planning
