#pragma once

#include <string>
#include <vector>

#include "tether/planning/plan/plan.h"
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
};

struct ResolvedPlan {
  planning::Plan plan;
  std::vector<ResolvedStep> steps;
};

/// Looks up names, and determines what is held at each step and which tool pushes. A step without verbs gets
/// a reach. Throws InputError with everything that can't be executed.
ResolvedPlan Resolve(const scene::Scene& scene, planning::Plan plan);

}  // namespace tether::execution
