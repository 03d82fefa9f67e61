#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tether/math/pose.h"
#include "tether/planning/plan/step_mode.h"
#include "tether/planning/skeleton/action.h"

namespace tether::planning {

/// The arm's motion to where a step begins: from the end of the step before to its first reach.
struct StepMotion {
  std::vector<Eigen::VectorXd> path;  ///< n each, rad, straight in between.
  double duration = 0;                ///< Of the whole step, with its straight motions, s.
  double clearance = 0;               ///< The path's least distance from anything, m, up to kMostClearance.
};
inline constexpr double kMostClearance = 0.05;

/// One key pose of a plan: `control` at X_TC in `target`, wherever the target moves. Names are bound.
struct PlanStep {
  std::string action;    ///< "pick(hook)"
  int action_index = 0;  ///< Which of the plan's actions.
  std::string control;   ///< A frame: an object, or "hand".
  std::string target;    ///< A frame: an object, or "world".
  math::Pose X_TC;       ///< Pose of the control frame in the target frame.
  std::vector<Verb> execute;
  /// An IK solution of the key pose, rad: it shows that the key pose is reachable, and starts the
  /// controller's posture search. Empty: not known.
  Eigen::VectorXd q = {};
  /// Of a compound on which `control` is put down, the face that it stands on: "part 1 of shelf". Else empty.
  /// For people: the pose says it.
  std::string face = {};
  /// What the arm may press with in this step, N, in place of what the scenario says.
  std::optional<double> max_force = {};
  std::optional<StepMotion> motion = {};  ///< None: not planned, or not planned for this kind of step.
  bool target_is_region = false;          ///< Any pose in the region `target` serves; X_TC is not used.

  // What follows from the plan's steps together: see SetModes().
  StepMode mode = StepMode::kFree;
  std::string held = {};  ///< The object in the hand as the step begins; empty: none.
  int grasp_step = -1;    ///< The step that grasped it; −1: none.
  std::string tool = {};  ///< What is brought to its pose by the arm: `control`, but of a push what pushes.
  /// Of a push: the tool in the control frame, as it touches; none: no step before brings it there.
  std::optional<math::Pose> X_CTool = {};
};

/// A chain of poses tied to objects. What `tether plan --output` writes (format `tether.plan/1`), the checker
/// judges and the executive runs.
struct Plan {
  std::string scenario;              ///< Title of the scenario it was made for.
  std::string robot;                 ///< The acting robot's name.
  std::string held = {};             ///< The object in the hand at the start; empty: none.
  std::vector<std::string> actions;  ///< "pick(hook)", "push(hook,box,table)", …
  std::vector<PlanStep> steps;
  double cost = 0;
};

}  // namespace tether::planning
