#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tether/execution/contact/after_contact.h"
#include "tether/execution/contact/supports.h"
#include "tether/execution/contact/touch.h"
#include "tether/execution/reference/arm_transit.h"
#include "tether/execution/reference/goal_search.h"
#include "tether/execution/sequencer/constraint_builder.h"
#include "tether/execution/sequencer/sequencer_options.h"
#include "tether/execution/servo/servo.h"
#include "tether/execution/servo/situation.h"
#include "tether/execution/servo/torque_servo.h"
#include "tether/execution/servo/velocity_servo_options.h"

namespace tether::execution {

/// Moves the arm by joint velocities, or torques, under constraints (paper B, section 3.2). With velocities a
/// step begins with a transit of the whole arm, where nothing but clearances constrains it; else each verb is
/// an objective of control::ConstrainedVelocity, and walls, objects and limits are kept at every tick, for
/// the links and for what is held.
///
/// - Steps may have regions as targets: a reach then brings the control frame above the region, into it if it
///   is solid, or a held object onto its plane, within the point-cone if the verb asks for one.
/// - A plan without key poses will do: where a step needs a grasp and the plan has none, one from above is
///   chosen.
/// - Contact is exempt for the pairs under `allow`, for a held object against what it stood on until it is
///   clear of that, and against what carries the region that it is brought to; and while it is above either,
///   within its outline, against what lies beneath that.
/// - A reach is done when its own constraints hold as well.
/// - After a contact the hand moves along with what it touched until it is clear of that.
/// - A verb without progress is reported with the constraints that stop it. Then a detour in joint space is
///   planned, within one tick, for now, while the arm stands, and followed under the same constraints.
class VelocityServo final : public Servo {
 public:
  VelocityServo(Situation& situation,
                const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                const SequencerOptions& shared, const VelocityServoOptions& options);

  // velocity_servo.cc
  void Prepare(robot::Commands* commands) const override;
  void Sense() override;
  void Begin() override;
  void BeginStep() override;
  void BeginVerb() override;
  void Rest(bool first) override;
  void HeldChanged() override;
  const Eigen::VectorXd* Carried() const override { return drive_ ? &drive_->carried() : nullptr; }
  void Resume() override;
  void Stop() override;
  void Command(const robot::Observations& observations, robot::Commands* commands) override;
  const TouchList& allowed() const override { return allowed_; }
  const std::vector<control::FieldConstraint>& verb_fields() const override;

  // velocity_reach.cc
  Progress Reach(const planning::ReachVerb& reach) override;
  Progress Shift(const planning::ShiftVerb& shift) override;
  /// How far the hand can open here and keep its clearances, m.
  double WidestOpening() override;

  const control::ConstrainedVelocity& controller() const { return controller_; }

 private:
  // velocity_servo.cc
  control::ConstrainedVelocity MakeController() const;
  void MakeDrive();
  void FindHandPose();
  void WatchSupports();
  void WatchSafety();
  void WatchDrive();

  // velocity_contact.cc: what may be touched.
  static Supports::Distances SupportDistances(const VelocityServoOptions& options);
  void UpdateAllowed();
  bool KeepsOff() const;
  void WatchApproach();
  void FindBeneath();
  /// The hand goes along with what was touched.
  void GoAlong(bool move);

  // velocity_force.cc
  void WatchForce();

  // velocity_reach.cc
  bool ComesToRest();
  Progress EnterReach(const planning::ReachVerb& reach);
  void EnterRegionReach(const planning::ReachVerb& reach, const scene::Region& region);
  Progress EnterFrameReach(const planning::ReachVerb& reach);
  /// Of the present step; nothing, with what is to be done then, if there is none.
  std::optional<math::Pose> KeyPose(Progress* missing);
  math::Pose Offset(const Eigen::Vector3d& offset, planning::In in, const math::Pose& X_TF,
                    const math::Pose& X_WT) const;
  math::Pose X_WTarget(const control::Frame& target) const;
  double TopAbove(const scene::Region& region, const math::Pose& X_WR) const;
  /// The lowest point of the held object along the region's axis, in the object's frame, and how far it
  /// reaches across.
  Eigen::Vector3d FootOf(ObjectId object, const Eigen::Vector3d& up_W, double* radius) const;

  // velocity_transit.cc
  bool IsFreeMotion(const planning::ReachVerb& reach) const;
  /// The hand at a reach of a step to a frame, in the base frame.
  math::Pose HandGoal(const planning::ReachVerb& reach, const math::Pose& X_TC) const;
  /// Plans one to the verb's goal, where the verb is a free motion and the goal is not near.
  void BeginTransit(const planning::ReachVerb& reach);
  Progress FollowTransit(const planning::ReachVerb& reach);

  // velocity_progress.cc
  Progress WatchProgress(double error);
  Progress Stall();
  void LeaveDetour();
  std::string WhatHoldsUp() const;
  void SearchGoal();
  /// Why no retry can help: what is to be reached is beyond the arm's reach; empty: it is not.
  std::string BeyondReach() const;
  bool TryDetour(std::string& why);
  /// velocity_detour.cc: configurations of a path around what obstructs the goal; empty, with the reason, if
  /// none is found.
  std::vector<Eigen::VectorXd> FindDetour(std::string& why);
  /// `place` puts what is held where the arm has it; `still`: all objects, at rest.
  std::vector<Eigen::VectorXd> FindDetourEnds(
      const std::function<void(const Eigen::VectorXd&)>& place,
      const IndexedVector<ObjectId, control::MovingPose>& still) const;

  const planning::StepSchema& schema() const { return s_.current().schema; }

  Situation& s_;
  const SequencerOptions shared_;
  const VelocityServoOptions options_;
  const std::map<std::string, std::shared_ptr<const robot::Model>> models_;
  ControlScene control_scene_;
  control::ConstrainedVelocity controller_;
  std::unique_ptr<TorqueDrive> drive_;  ///< Where the arm is driven by torques.
  ProgressWatch watch_;
  GoalSearch goal_search_;
  ArmTransit transit_;
  int transits_ = 0;         ///< Planned for the present step.
  math::Pose X_BGoal_;       ///< Of the hand, as the transit was planned.
  bool has_fields_ = false;  ///< The scenario constrains frames to be outside of something.

  bool placed_ = false;       ///< The controller has seen the arm.
  bool entered_ = false;      ///< The present motion.
  double braked_since_ = -1;  ///< Before it; −1: not.
  bool keeps_off_ = false;    ///< The hand is clear of the step's target, and does not touch it yet.
  std::optional<control::Goal> goal_;
  std::optional<math::Pose> grasp_;  ///< Chosen for this step, where the plan has no key pose …
  double grasp_width_ = 0;           ///< … with this between the fingers, m.
  double speed_ = 0, tolerance_m_ = 0, tolerance_rad_ = 0;
  std::vector<control::FieldConstraint> verb_fields_;  ///< The controller's, of the present verb.
  Supports supports_;
  AfterContact after_contact_;
  TouchList allowed_;
  std::vector<std::pair<int, int>> allowed_bodies_;  ///< `allowed_`, by the controller's numbers.
  std::vector<ObjectId> first_ends_, second_ends_;
  std::vector<ObjectId> carriers_, carriers_next_;  ///< What carries the region that this step is about.
  std::vector<ObjectId> beneath_,
      beneath_next_;                   ///< What lies under these, or under what carries the target.
  math::Pose goal_pose_;               ///< Of the hand, of a shift, in the frame of `along_` or the base.
  ObjectId along_;                     ///< The object that the goal goes along with.
  std::vector<Eigen::VectorXd> path_;  ///< A detour that is being followed; what is left of it.
  size_t waypoint_ = 0;
  int detours_ = 0;
  double relaxed_until_ = -1, escaping_until_ = -1;
  bool faulty_ = false;
  robot::Kinematics kinematics_;  ///< Of the measured joints.
  Eigen::MatrixXd J_BH_;
  double pressed_since_ = -1, backs_off_until_ = -1;
  control::Goal back_off_;
};

}  // namespace tether::execution
