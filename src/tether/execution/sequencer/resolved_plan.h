#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tether/common/id.h"
#include "tether/control/constraint_spec.h"
#include "tether/planning/plan/plan.h"
#include "tether/planning/skeleton/action.h"
#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::execution {

/// No object: the hand itself, the world, nothing.
inline constexpr ObjectId kNone{};
inline constexpr int kNoStep = -1;

/// A frame fixed to an object of the scene, or to the world (`object` is kNone).
struct AttachedFrame {
  ObjectId object;
  math::Pose X_OF;
};

/// One of two that an action's step allows to touch: the hand, an object, or what carries a region.
struct AllowedEnd {
  bool hand = false;
  ObjectId object;
  int region = -1;  ///< Index in Scene::regions.
};

/// A step of a plan with its names looked up: the tool, what the hand holds or the hand itself, is brought to
/// X_TC · X_CTool in the target frame T.
struct ResolvedStep {
  AttachedFrame target;
  ObjectId control;                       ///< kNone: the hand.
  ObjectId tool;                          ///< kNone: the hand.
  bool push = false;                      ///< The control frame is moved by the tool.
  math::Pose X_CTool;                     ///< Identity unless this is a push.
  int first_reach = 0;                    ///< Index of the first reach among the verbs.
  int grasp_step = kNoStep;               ///< The step that grasped what is held as this one begins.
  int action_start = 0;                   ///< First step of the same action.
  IndexedVector<int, ObjectId> close_on;  ///< Per verb: what the gripper closes on, or kNone.

  // Of steps that ResolveActions() has bound.
  planning::StepSchema schema;
  int region = -1;  ///< That is the target, by its index in Scene::regions.
  std::vector<std::pair<AllowedEnd, AllowedEnd>> allow;            ///< Pairs that may touch.
  std::optional<math::Pose> X_TC;                                  ///< The plan's key pose, if it has one.
  IndexedVector<int, std::vector<control::ConstraintSpec>> specs;  ///< Per verb: its own constraints.
};

struct ResolvedPlan {
  planning::Plan plan;
  IndexedVector<int, ResolvedStep> steps;
};

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
