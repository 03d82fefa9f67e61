#pragma once

#include <limits>
#include <optional>
#include <utility>

#include "tether/execution/observer/frame_tracker.h"
#include "tether/execution/reference/posture_search.h"
#include "tether/execution/sequencer/executive.h"
#include "tether/execution/sequencer/resolved_plan.h"

namespace tether::execution {

/// An arm that isn't the plan's: it keeps its hand where it was first seen.
struct Neighbour {
  std::string name;
  robot::State state;
  control::OperationalSpaceController controller;
  control::HandTarget target;
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
  Eigen::Vector3d funnel_T = Eigen::Vector3d::UnitZ();  ///< Direction of the approach, unit.
  double funnel_length = 0;                             ///< Its length, m; 0: no approach.
  double least_error = std::numeric_limits<double>::infinity();
  double progress_time = 0;
  double quiet_time = 0;  ///< How long a condition has held, s.
  double last_opening = 0;
  Eigen::Vector3d approach_T = Eigen::Vector3d::Zero();  ///< Direction of the whole motion, unit.
  math::Pose X_TC_start;                                 ///< Of a pushed object, as the push began.
  math::Pose X_TH_start;
  Eigen::Vector3d normal_C =
      Eigen::Vector3d::Zero();  ///< Into the pushed object, level, where it is pressed.
  double slope = 0;             ///< Tangent of the angle to it that a push may have and not slip.
  double least_left = std::numeric_limits<double>::infinity();  ///< Of the push, m.
  /// What a pushed object has to be led beside its line so that it stays on it, m per kLookAhead.
  Eigen::Vector3d drift_T = Eigen::Vector3d::Zero();
  bool clear = false;  ///< Of what was touched before the verb.
};

enum class Outcome { kRunning, kDone, kAborted };

/// What was touched, and by what: verbs after a contact move along with it until they are clear of it.
struct Contact {
  AttachedFrame frame;   ///< In the world if nothing that can move was touched.
  int held = kNone;      ///< What the hand holds; kNone: the hand itself touches.
  int released = kNone;  ///< The object that the hand has released, on `frame`.
};

struct Executive::Impl {
  Impl(const scene::Scene& scene_in, const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
       planning::Plan plan_in, const ExecutiveOptions& options_in);

  // executive.cc: the tick and its bookkeeping.
  const robot::Commands& Step(const scene::WorldEstimate& estimate, const robot::Observations& observations);
  void Sense(const scene::WorldEstimate& estimate, const robot::Observation& seen);
  void RunVerb();
  void EnterStep(int index);
  void FinishStep();
  void MonitorGrasp();
  void Record(EventKind kind, std::string text);
  void Abort(EventKind kind, const std::string& reason, int resume, bool open);

  // servo.cc: from the verb's goal to torques.
  void MoveReference();
  void AimPosture();
  void AvoidObstacles(control::HandTarget* target);
  void Command(robot::Command* command);
  void WatchController();

  // constrained_servo.cc: the same with the constrained torque controller.
  void MakeServo();
  /// Whether `touching_` has changed.
  bool FindAllowed();
  void NameAllowed();
  /// What the held object stood on, until it is clear of it.
  void WatchSupports();
  void CommandConstrained(const control::HandTarget& target, robot::Command* command);
  void WatchServo();

  // verbs.cc: each returns whether it is done.
  Outcome Run(const planning::ReachVerb& verb);
  Outcome Run(const planning::ShiftVerb& verb);
  Outcome Run(const planning::GripperVerb& verb);
  Outcome Run(const planning::WaitVerb& verb);
  void EnterReach(const planning::ReachVerb& verb);
  Outcome ReachUntilContact(const planning::ReachVerb& verb, double position_error, double rotation_error);

  // push.cc
  void EnterPush();
  Outcome RunPush(const planning::ReachVerb& verb);
  bool PushSlips();
  Outcome FinishPush();
  math::Pose ToolGoal(const planning::ReachVerb& verb) const;
  bool OutOfReach(const math::Pose& X_TH) const;
  /// The object was put, or stood at the start, on the carrier, or on something that was.
  bool IsCarriedBy(int carrier, int object) const;
  /// Finds what stands on what is held.
  void FindCarried();
  bool MovesWithHand(int object) const {
    return held_ != kNone && (object == held_ || carried_[static_cast<size_t>(object)]);
  }
  std::pair<double, double> ToolError(const math::Pose& X_TTool_goal) const;
  bool Stalled(double error);
  void Hold();

  // contact_frame.cc
  Contact TouchedNow() const;
  bool IsClearOf(const Contact& contact) const;
  void GoAlong();
  int CarrierOf(int object) const;

  // free_place.cc
  bool PutsDown() const;
  double RoomAt(const math::Pose& X_WC, int* nearest) const;
  int CornersOver(const math::Pose& X_WC) const;
  void FindFreePlace();

  // servo.cc: frames.
  math::Pose X_WF(const AttachedFrame& frame) const;
  math::Vector6d V_WF(const AttachedFrame& frame) const;
  math::Pose X_WR() const { return X_WF(frame_) * reference_.X_TR(); }
  void SwitchFrame(const AttachedFrame& frame);
  void ResetReferenceToHand();
  const math::Pose& X_WO(int object) const { return objects_[object].X_WF(); }
  const ResolvedStep& step() const { return resolved_.steps[step_]; }
  const planning::PlanStep& plan_step() const { return resolved_.plan.steps[step_]; }
  const std::vector<planning::Verb>& verbs() const { return recovering_ ? recovery_ : plan_step().execute; }
  bool IsFreeMotion() const;

  const scene::Scene scene_;
  const ExecutiveOptions options_;
  const ResolvedPlan resolved_;
  const std::string robot_;
  const std::shared_ptr<const robot::Model> model_;
  math::Pose X_WB_;
  const geometry::Shape hand_shape_;

  robot::State state_;
  control::OperationalSpaceController controller_;
  std::optional<TorqueServo> servo_;  ///< In place of `controller_`.
  std::vector<control::MovingPose> object_motions_;
  std::vector<Touch> touching_, named_;                       ///< That the step may bring into contact.
  std::vector<std::pair<std::string, std::string>> allowed_;  ///< The same by name.
  std::vector<int> supports_;                                 ///< Of what is held, since it was taken.
  int supported_ = kNone;                                     ///< The object that they are of.
  double relaxed_time_ = -1, violated_time_ = -1;             ///< When this was last reported, s.
  PostureSearch posture_search_;
  ContactDetector contact_;
  PoseReference reference_;
  AttachedFrame frame_;  ///< The frame T that the reference lives in.
  std::vector<FrameTracker> objects_;
  std::vector<bool> carried_;  ///< On what is held; only while something is.
  std::vector<Neighbour> neighbours_;
  std::vector<Bounds> body_bounds_, obstacle_bounds_;

  // What is known at this tick.
  bool started_ = false;
  bool trustworthy_ = true;  ///< The observation is finite.
  double time_ = 0;
  double estimate_time_ = -std::numeric_limits<double>::infinity();
  long tick_ = 0;
  math::Pose X_WH_;
  math::Vector6d V_WH_;
  double opening_ = 0;
  Eigen::Vector3d force_W_ = Eigen::Vector3d::Zero();
  Eigen::VectorXd tau_external_;

  // Where execution stands.
  ExecutiveStatus status_;
  int step_ = 0;
  int verb_ = 0;
  VerbState now_;
  bool recovering_ = false;
  std::vector<planning::Verb> recovery_;
  Contact before_recovery_;  ///< What was touched as the recovery began.
  int held_ = kNone;
  double held_width_ = 0;  ///< Between the fingers as it was grasped, m.
  double held_since_ = 0;
  double lost_time_ = 0;
  math::Pose X_HO_grasp_;
  math::Pose X_ToolHand_;  ///< The hand in the tool's frame, as it is held now (smoothed).
  bool turned_ = false;    ///< The hand has the plan's orientation turned by half a turn.
  robot::GripperCommand gripper_;
  Eigen::VectorXd posture_, posture_goal_;
  Eigen::Vector3d obstacle_direction_B_ = Eigen::Vector3d::Zero();
  double obstacle_weight_ = 0;

  std::map<int, int> retries_;  ///< By action index.
  /// Of the step's control frame in its target: the plan's, or a free one beside it.
  math::Pose X_TC_;
  int retry_count_ = 0;
  bool estimate_bad_ = false;
  bool limit_reported_ = false;  ///< In this step.
  bool fault_reported_ = false;
  std::vector<Event> events_;
  std::vector<StepRecord> records_;
  robot::Commands commands_;
};

/// "12.3 mm".
std::string Millimetres(double metres);

}  // namespace tether::execution
