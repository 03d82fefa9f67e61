#pragma once

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tether/control/operational_space.h"
#include "tether/control/torque/torque_limiter.h"
#include "tether/execution/contact/after_contact.h"
#include "tether/execution/contact/supports.h"
#include "tether/execution/contact/touch.h"
#include "tether/execution/observer/contact_detector.h"
#include "tether/execution/reference/arm_transit.h"
#include "tether/execution/reference/pose_reference.h"
#include "tether/execution/reference/posture_search.h"
#include "tether/execution/reference/reach_search.h"
#include "tether/execution/reference/transit.h"
#include "tether/execution/sequencer/sequencer_options.h"
#include "tether/execution/servo/reference_servo_options.h"
#include "tether/execution/servo/servo.h"
#include "tether/execution/servo/situation.h"
#include "tether/execution/servo/torque_servo.h"

namespace tether::execution {

/// An arm that isn't the plan's: it keeps its hand where it was first seen.
struct Neighbour {
  std::string name;
  robot::State state;
  control::OperationalSpaceController controller;
  control::HandTarget target;
  std::unique_ptr<control::TorqueLimiter> limiter;
  bool started = false;
};

/// The state of the verb that is being executed.
struct VerbState {
  double start = 0;
  bool entered = false;
  int phase = 0;
  math::Pose X_TG;       ///< Where the reference goes, hand pose in the target frame.
  double speed = 0;      ///< Greatest linear speed, m/s.
  bool transit = false;  ///< Obstructions are passed above.
  Eigen::Vector3d funnel_T = Eigen::Vector3d::UnitZ();   ///< Direction of the approach, unit.
  double funnel_length = 0;                              ///< Its length, m; 0: no approach.
  Eigen::Vector3d approach_T = Eigen::Vector3d::Zero();  ///< Direction of the whole motion, unit.
  math::Pose X_TC_start;                                 ///< Of a pushed object, as the push began.
  math::Pose X_TH_start;
  Eigen::Vector3d normal_C =
      Eigen::Vector3d::Zero();  ///< Into the pushed object, level, where it is pressed.
  double slope = 0;             ///< Tangent of the angle to it that a push may have and not slip.
  /// What a pushed object has to be led beside its line so that it stays on it, m per kLookAhead.
  Eigen::Vector3d drift_T = Eigen::Vector3d::Zero();
  double length = 0;     ///< Of a shift, m.
  bool aligned = false;  ///< The reference has come to the line of the approach.
};

/// Moves the hand by torques: it is servoed to a reference that moves, in the frame of the step's target,
/// with bounded speed and acceleration towards the pose that is wanted there; the target's own velocity is
/// fed forward.
///
/// - The hand as control frame: a parallel gripper turned by half a turn about its approach grasps alike. Of
///   the two orientations, the one with more room to the joint limits is chosen, at the first reach of the
///   step.
/// - A held object as control frame is servoed through the hand, at the pose in the hand where it is now.
/// - Any other object as control frame is pushed by what the hand holds, or by the hand, until the *object*
///   is at its pose in the plan: the tool's goal follows from the object's pose at each tick (ERRATA A15).
///   See push.cc.
/// - A reach that isn't preceded by another one in its step is a transit: obstacles are passed above. Later
///   ones, and pushes, go straight.
class ReferenceServo final : public Servo {
 public:
  ReferenceServo(Situation& situation,
                 const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                 const SequencerOptions& shared, const ReferenceServoOptions& options);

  // reference_servo.cc
  void Prepare(robot::Commands* commands) const override;
  void Sense() override;
  void Begin() override;
  void BeginStep() override;
  void BeginVerb() override;
  void Rest(bool first) override;
  double WidestOpening() override { return s_.model->gripper().max_opening; }
  double HeldMass() const override { return servo_ ? servo_->HeldMass() : 0; }
  void HeldChanged() override;
  const Eigen::VectorXd* Carried() const override { return servo_ ? &servo_->carried() : &carried_torque_; }
  void Resume() override;
  void Stop() override;
  void Command(const robot::Observations& observations, robot::Commands* commands) override;
  const TouchList& allowed() const override { return allowed_; }

  // reach.cc
  Progress Reach(const planning::ReachVerb& verb) override;
  Progress Shift(const planning::ShiftVerb& verb) override;

 private:
  // tracking.cc: from the verb's goal to torques.
  void MoveReference();
  void AimPosture();
  void AvoidObstacles(control::HandTarget* target);
  void CommandTorque(robot::Command* command);
  control::HandTarget TargetNow() const;
  /// While the arm is stopped: where it came to rest, or, before that, where it is.
  control::HandTarget RestingTarget();
  void WatchController();

  // constrained_tracking.cc: the same with the constrained torque controller.
  void MakeServo();
  void FindAllowed();
  /// What the present step may press with, N.
  double MaxForce() const;
  void CommandConstrained(const control::HandTarget& target, robot::Command* command);
  void WatchServo();

  void CommandOthers(const robot::Observations& observations, robot::Commands* commands);

  // reach.cc
  bool IsFreeMotion() const;
  void EnterReach(const planning::ReachVerb& verb);
  Progress ReachUntilContact(const planning::ReachVerb& verb, double position_error, double rotation_error);
  math::Pose ToolGoal(const planning::ReachVerb& verb) const;
  bool OutOfReach(const math::Pose& X_TH);
  Progress BeyondReach(int resume);
  /// Of the hand relative to the frame that the reference lives in, in the world: m/s, rad/s.
  math::Vector6d HandVelocity() const;
  std::pair<double, double> ToolError(const math::Pose& X_TTool_goal) const;
  bool Stalled(double error);
  /// Why the hand comes no nearer, to follow how far it is: ": held up by the hand near 'bench'", or empty.
  std::string WhatHoldsUp() const;
  void Hold();

  // approach_speed.cc
  /// The distance of the hand, and of what it holds, from anything else, m.
  double FindRoom() const;
  void LimitMotion(MotionLimits* limits);

  // arm_motion.cc: transits of the whole arm.
  /// Plans one to the verb's goal, unless that is near. `from`: the arm's configuration.
  /// `velocity`: how it moves there.
  void BeginTransit(const planning::ReachVerb& verb, const Eigen::VectorXd& from,
                    const Eigen::VectorXd& velocity);
  /// Brakes where the goal has moved or something came into the path; at rest, plans anew.
  void WatchTransit(const planning::ReachVerb& verb);
  /// The reference follows the transit for a tick, at a share of its speed.
  void FollowTransit(double rate);
  void LeaveTransit();
  /// Whether the present reach may end in motion, at its pregrasp …
  bool TurnsIntoApproach();
  /// … and the present shift, of which so much is left, m.
  bool TurnsIntoTransit(double left) const;

  // push.cc
  void EnterPush();
  Progress RunPush(const planning::ReachVerb& verb);
  bool PushSlips() const;
  /// The turn that a pushed object still lacks when it is at X_TC, as a rotation vector; none about the axis
  /// of a round one.
  Eigen::Vector3d TurnLeft(const math::Pose& X_TC) const;
  Progress FinishPush();

  bool MovesWithHand(ObjectId object) const {
    return s_.held != kNone && (object == s_.held || carried_[object]);
  }
  /// The reference goes on in another frame where what was touched asks for it; its goal does not jump.
  void GoAlong();

  // free_place.cc
  bool PutsDown() const;
  double RoomAt(const math::Pose& X_WC, ObjectId* nearest) const;
  int CornersOver(const math::Pose& X_WC) const;
  void FindFreePlace();

  // tracking.cc: frames.
  math::Pose X_WF(const AttachedFrame& frame) const { return s_.X_WF(frame); }
  math::Vector6d V_WF(const AttachedFrame& frame) const { return s_.V_WF(frame); }
  const math::Pose& X_WO(ObjectId object) const { return s_.X_WO(object); }
  math::Pose X_WR() const { return X_WF(frame_) * reference_.X_TR(); }
  void SwitchFrame(const AttachedFrame& frame);
  void ResetReferenceToHand();

  Situation& s_;
  const SequencerOptions shared_;
  const ReferenceServoOptions options_;
  const geometry::Shape hand_shape_;

  robot::State state_;
  control::OperationalSpaceController controller_;
  std::optional<TorqueServo> servo_;               ///< In place of `controller_` …
  std::optional<control::TorqueLimiter> limiter_;  ///< … behind which this stands.
  Eigen::VectorXd carried_torque_;
  TouchList allowed_;  ///< That the step may bring into contact.
  Supports supports_;
  AfterContact after_contact_;
  double relaxed_time_ = -1, violated_time_ = -1;  ///< When this was last reported, s.
  PostureSearch posture_search_;
  double room_ = -1;  ///< As FindRoom() last said; −1: not asked in this verb.
  ArmTransit transit_;
  robot::Kinematics reference_arm_;  ///< The arm as the transit has it.
  Eigen::MatrixXd reference_J_;
  math::Vector6d V_BR_ = math::Vector6d::Zero();  ///< Of the hand on the transit.
  math::Pose X_BGoal_;                            ///< Of the hand, as the transit was planned.
  int transits_ = 0;                              ///< Planned for the present reach.
  bool path_ended_ = false;                       ///< The present reach has followed its path to the end.
  ReachSearch reach_search_;
  double lacking_ = 0;  ///< To a pose that is out of reach, m.
  ContactDetector contact_;
  PoseReference reference_;
  AttachedFrame frame_;                    ///< The frame T that the reference lives in.
  IndexedVector<ObjectId, bool> carried_;  ///< On what is held; only while something is.
  std::vector<Neighbour> neighbours_;
  std::vector<geometry::Aabb> body_bounds_, obstacle_bounds_;
  ProgressWatch watch_;
  long tick_ = 0;
  Eigen::Vector3d force_W_ = Eigen::Vector3d::Zero();

  VerbState now_;
  math::Pose X_ToolHand_;  ///< The hand in the tool's frame, as it is held now (smoothed).
  bool turned_ = false;    ///< The hand has the plan's orientation turned by half a turn.
  Eigen::VectorXd posture_, posture_goal_;
  Eigen::Vector3d obstacle_direction_B_ = Eigen::Vector3d::Zero();
  double obstacle_weight_ = 0;
  /// Of the step's control frame in its target: the plan's, or a free one beside it.
  math::Pose X_TC_;
  bool limit_reported_ = false;  ///< In this step.
  bool fault_reported_ = false;
  std::optional<math::Pose> resting_;  ///< Where a stopped arm has come to rest, of the hand in the base.
};

}  // namespace tether::execution
