#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tether/control/constraint_spec.h"
#include "tether/planning/plan/plan.h"
#include "tether/planning/skeleton/action.h"
#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::execution {

inline constexpr int kNone = -1;

/// A frame fixed to an object of the scene, or to the world (`object` is kNone).
struct AttachedFrame {
  int object = kNone;
  math::Pose X_OF;
};

/// A step of a plan with its names looked up: the tool, what the hand holds or the hand itself, is brought to
/// X_TC · X_CTool in the target frame T.
struct ResolvedStep {
  AttachedFrame target;
  int control = kNone;        ///< Object index; kNone: the hand.
  int tool = kNone;           ///< Object index; kNone: the hand.
  bool push = false;          ///< The control frame is moved by the tool.
  math::Pose X_CTool;         ///< Identity unless this is a push.
  int first_reach = 0;        ///< Index of the first reach among the verbs.
  int grasp_step = kNone;     ///< The step that grasped what is held as this one begins.
  int action_start = 0;       ///< First step of the same action.
  std::vector<int> close_on;  ///< Per verb: object index, or kNone.

  // Of steps that ResolveActions() has bound.
  planning::StepSchema schema;
  std::optional<math::Pose> X_TC;                           ///< The plan's key pose, if it has one.
  std::vector<std::vector<control::ConstraintSpec>> specs;  ///< Per verb: its own constraints.
};

struct ResolvedPlan {
  planning::Plan plan;
  std::vector<ResolvedStep> steps;
};

/// Index of an object; kNone: there is none of that name.
int FindObject(const scene::Scene& scene, const std::string& name);
/// A frame by name: a region, or a robot's base, is fixed to the object, if any, that it descends from.
std::optional<AttachedFrame> FindFrame(const scene::Scene& scene, const std::string& name);

/// Whether a plan has steps to regions, or reaches with objectives: they are for the servo that follows
/// objectives.
bool NeedsObjectives(const planning::Plan& plan);

/// Looks up names. A step without verbs gets a reach. The steps' modes must be set. Throws InputError with
/// everything that can't be executed.
ResolvedPlan Resolve(const scene::Scene& scene, planning::Plan plan);

/// Makes a plan's steps from its actions, which are bound to `actions`; key poses are the plan's, as far as
/// it has them. Throws InputError with everything that can't be executed: unknown names, steps that can't be
/// bound, regions that are out of the robot's reach.
ResolvedPlan ResolveActions(const scene::Scene& scene, const robot::Model& model,
                            const std::vector<planning::ActionSchema>& actions, planning::Plan plan);

}  // namespace tether::execution
