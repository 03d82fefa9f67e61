#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tether/common/id.h"
#include "tether/constraints/core/kind.h"
#include "tether/planning/plan/problem.h"
#include "tether/scene/frames.h"

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
  FrameId control, target;
  std::vector<std::pair<FrameId, FrameId>> allow;  ///< Pairs that may touch.
  std::vector<FrameId> close_on;                   ///< Per verb: what the gripper closes on; else not valid.
  StepSchema schema;                               ///< As written, with the action's arguments.
  std::vector<BoundConstraint> constraints;        ///< Its own, then those that hold at every step.
};

/// A sequence of actions with all names bound: what is optimised, judged and executed.
struct Skeleton {
  std::shared_ptr<const scene::Frames> frames;  ///< What the steps' ids mean.
  std::vector<std::string> actions;
  std::vector<BoundStep> steps;
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

/// Binds actions to their schemas and to the frames of a scene.
class SkeletonBinder {
 public:
  /// All must outlive this. `always` are constraints that hold at every step with a key pose.
  SkeletonBinder(const scene::Scene& scene, std::shared_ptr<const scene::Frames> frames,
                 const std::vector<ActionSchema>& actions, const std::vector<ConstraintSpec>& always);

  /// The steps of an action as the first of a skeleton. Reports an action without geometry, a frame that is
  /// not in the scene, and parameters that do not suit a constraint.
  std::vector<BoundStep> BindAction(const std::string& action, Diagnostics& diagnostics) const;
  /// The key poses of a sequence of actions. Throws InputError with all that BindAction() reports.
  Skeleton Bind(const std::vector<std::string>& actions) const;

 private:
  bool Bind(StepSchema schema, BoundStep& step, const std::string& name, Diagnostics& diagnostics) const;
  FrameId FindFrame(const std::string& name, const Location& where, const std::string& what,
                    Diagnostics& diagnostics) const;
  BoundConstraint Bind(const ConstraintSpec& spec, FrameId moved, Diagnostics& diagnostics) const;

  const scene::Scene& scene_;
  std::shared_ptr<const scene::Frames> frames_;
  const std::vector<ActionSchema>& actions_;
  const std::vector<ConstraintSpec>& always_;
};

/// The key poses of a sequence of actions of a problem. Throws InputError as SkeletonBinder::Bind().
std::vector<BoundStep> BindSkeleton(const Problem& problem, const std::vector<std::string>& actions);

}  // namespace tether::planning
