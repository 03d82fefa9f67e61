#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tether/execution/observer/frame_tracker.h"
#include "tether/execution/sequencer/constraint_builder.h"
#include "tether/execution/sequencer/velocity_executive.h"

namespace tether::execution {

/// A step with names bound.
struct BoundVelocityStep {
  planning::StepSchema schema;
  std::optional<math::Pose> X_TC;  ///< The plan's key pose, if it has one.
  int action_start = 0;            ///< First step of the same action.
};

struct VelocityExecutive::Impl {
  enum class Outcome { kRunning, kDone, kAborted };

  Impl(const scene::Scene& scene_in, const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
       const std::vector<planning::ActionSchema>& actions, planning::Plan plan_in,
       const VelocityExecutiveOptions& options_in);

  // velocity_binding.cc
  void BindPlan(const std::vector<planning::ActionSchema>& actions);
  void CheckReach(Diagnostics& diagnostics) const;
  control::ConstraintNames Names() const;
  control::ConstrainedVelocity MakeController();

  // velocity_executive.cc
  void Sense(const scene::WorldEstimate& estimate, const robot::Observations& observations);
  void Advance();
  void Control();
  void WatchHeld();
  void WatchSafety();
  void StartStep(int step);
  void FinishStep();
  void UpdateAllowed();
  void Record(EventKind kind, const std::string& text);
  void Abort(EventKind kind, const std::string& text, bool retry);
  /// Goes on with other actions, or fails.
  void GiveUpAction(const std::string& reason);
  bool TryAlternative(std::string& why);
  void Fail(const std::string& reason);
  void Hold(int object);
  void Release();

  // velocity_contact.cc
  void FindCarriers(const scene::Region& region, std::vector<int>& found) const;
  void FindBeneath();
  bool IsOver(int object, int carrier) const;
  int ContactObject() const;
  bool IsClearOf(int object) const;
  void GoAlong(bool move);
  bool MissedItsRegion();

  // velocity_verbs.cc
  Outcome RunVerb();
  Outcome Run(const planning::ReachVerb& verb);
  Outcome Run(const planning::ShiftVerb& verb);
  Outcome Run(const planning::GripperVerb& verb);
  Outcome Run(const planning::WaitVerb& verb);
  bool EnterReach(const planning::ReachVerb& verb);
  bool EnterRegionReach(const planning::ReachVerb& verb, const scene::Region& region);
  bool EnterFrameReach(const planning::ReachVerb& verb);
  std::optional<math::Pose> KeyPose();
  math::Pose Offset(const Eigen::Vector3d& offset, planning::In in, const math::Pose& X_TF,
                    const math::Pose& X_WT) const;
  /// How far the hand can open here and keep its clearances, m.
  double FreeOpening();
  Outcome WatchProgress(double error);
  std::string WhatHoldsUp() const;
  /// Why no retry can help: what is to be reached is far beyond the arm's reach; empty: it is not.
  std::string BeyondReach() const;
  bool TryDetour(std::string& why);
  /// velocity_detour.cc: configurations of a path around what obstructs the goal; empty, with the reason, if
  /// none is found.
  std::vector<Eigen::VectorXd> FindDetour(std::string& why);

  const planning::StepSchema& schema() const { return steps[static_cast<size_t>(at)].schema; }
  math::Pose X_WTarget(const control::Frame& target) const;
  double TopAbove(const scene::Region& region, const math::Pose& X_WR) const;
  /// The lowest point of the held object along the region's axis, in the object's frame, and how far it
  /// reaches across.
  Eigen::Vector3d FootOf(int object, const Eigen::Vector3d& up_W, double* radius) const;
  const std::string& object_name(int object) const { return scene.objects[static_cast<size_t>(object)].name; }

  scene::Scene scene;
  ControlScene control_scene;
  std::shared_ptr<const robot::Model> model;
  std::string robot_name;
  planning::Plan plan;
  VelocityExecutiveOptions options;
  std::vector<planning::ActionSchema> schemas;
  std::vector<BoundVelocityStep> steps;
  control::ConstrainedVelocity controller;

  // Sensed.
  double time = 0;
  bool sensed = false;
  Eigen::VectorXd q;
  double opening = 0;
  std::vector<control::MovingPose> objects;  ///< In the world.
  std::vector<FrameTracker> trackers;        ///< Of the objects: their velocities.
  std::vector<bool> invalid;                 ///< Its last pose was not finite.
  math::Pose X_WH;

  // State.
  int at = 0;
  size_t verb = 0;
  bool entered = false;
  double verb_start = 0;
  std::optional<control::Goal> goal;
  std::optional<math::Pose> grasp;  ///< Chosen for this step, where the plan has no key pose …
  double grasp_width = 0;           ///< … with this between the fingers, m.
  double speed = 0, tolerance_m = 0, tolerance_rad = 0;
  double best_error = 0, progress_time = 0;
  double last_opening = 0, quiet_since = 0;
  int held = -1;
  std::string held_name;
  math::Pose X_HO_grasp;
  double lost_since = -1;
  std::vector<control::FieldConstraint> verb_fields;  ///< The controller's, of the present verb.
  std::vector<std::pair<int, int>> allowed_bodies;    ///< `allowed`, by the controller's numbers.
  std::vector<int> supports;                          ///< What the held object stood on and still touches.
  std::vector<int> carriers, carriers_next;           ///< What carries the region that this step is about.
  std::vector<int> beneath, beneath_next;  ///< What lies under these, or under what carries the target.
  int released = -1;                       ///< In this step.
  math::Pose goal_pose;                    ///< Of the hand, of a shift, in the frame of `along` or the base.
  int along = -1;                          ///< The object that the goal goes along with.
  bool clear = false;                      ///< Of what was touched before this verb.
  std::vector<Eigen::VectorXd> path;       ///< A detour that is being followed; what is left of it.
  size_t waypoint = 0;
  int detours = 0;
  int retries = 0;
  int replanner = 0;
  std::string held_before;  ///< What the hand held when the present action began.
  std::map<int, int> retries_of_action;
  double relaxed_until = -1, escaping_until = -1;
  bool faulty = false;

  ExecutiveStatus status;
  std::vector<Event> events;
  std::vector<StepRecord> records;
  std::vector<std::pair<std::string, std::string>> allowed;
  robot::Commands commands;
  robot::GripperCommand gripper;
};

}  // namespace tether::execution
