#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "tether/execution/observer/grasp_width.h"
#include "tether/execution/sequencer/executive_impl.h"

namespace tether::execution {
namespace {

using planning::In;

// A motion has ended when the reference is this near to its goal and the hand this slow.
constexpr double kArrived = 0.001;      // m
constexpr double kArrivedAngle = 0.01;  // rad
constexpr double kSlow = 0.02;          // m/s
constexpr double kSlowRate = 3;  // 1/s: slower for tight tolerances, so that the rest of the error fades
constexpr double kShiftTolerance = 0.015;  // m
// Contact that is felt this far before the pose is with something else, m.
constexpr double kEarlyContact = 0.03;
// A stalled reach that is this near counts as done: the next verbs show whether it was near enough.
constexpr double kNearlyThere = 0.015;      // m
constexpr double kNearlyThereAngle = 0.15;  // rad
// The gripper has settled when its opening has changed by less than this for so long.
constexpr double kSettledOpening = 0.0003;  // m
constexpr double kSettledTime = 0.12;       // s
constexpr double kGripperTimeout = 3;       // s
// A pose so far outside the reach is not tried, m.
constexpr double kBeyondReach = 0.1;
// Time constant with which slip in the hand is followed, s.
constexpr double kSlipTime = 0.05;

const math::Pose& HalfTurn() {
  static const math::Pose turn(math::ExpSO3(Eigen::Vector3d(0, 0, std::numbers::pi)),
                               Eigen::Vector3d::Zero());
  return turn;
}

// Moves `X` towards `goal` by the share `s`.
math::Pose Blend(const math::Pose& X, const math::Pose& goal, double s) {
  return {math::ProjectToSO3(X.R * math::ExpSO3(s * math::LogSO3(X.R.transpose() * goal.R))),
          X.p + s * (goal.p - X.p)};
}

}  // namespace

bool Executive::Impl::IsFreeMotion() const {
  if (recovering_ || step().push || verb_ != step().first_reach) return false;
  const auto* reach = std::get_if<planning::ReachVerb>(&verbs()[static_cast<size_t>(verb_)]);
  return reach != nullptr && !reach->until_contact;
}

void Executive::Impl::Hold() {
  SwitchFrame({});
  now_.transit = false;
}

math::Pose Executive::Impl::ToolGoal(const planning::ReachVerb& verb) const {
  math::Pose X_TC = X_TC_;
  switch (verb.in) {
    case In::kControl:
      X_TC = X_TC * math::Pose(verb.offset);
      break;
    case In::kTarget:
      X_TC.p += verb.offset;
      break;
    case In::kHand:
      X_TC.p += (X_TC * step().X_CTool * X_ToolHand_).R * verb.offset;
      break;
    case In::kWorld:
      X_TC.p += X_WF(step().target).R.transpose() * verb.offset;
      break;
  }
  return X_TC * step().X_CTool;
}

std::pair<double, double> Executive::Impl::ToolError(const math::Pose& X_TTool_goal) const {
  const math::Pose X_TTool = math::Between(X_WF(frame_), X_WH_ * X_ToolHand_.Inverse());
  return {(X_TTool.p - X_TTool_goal.p).norm(), math::AngleBetween(X_TTool.R, X_TTool_goal.R)};
}

bool Executive::Impl::Stalled(double error) {
  const bool moving = reference_.V_TR().head<3>().norm() > 0.01 || reference_.V_TR().tail<3>().norm() > 0.05;
  if (moving || error < now_.least_error - 0.001) {
    now_.least_error = std::min(error, now_.least_error);
    now_.progress_time = time_;
  }
  return time_ - now_.progress_time > options_.stall_time || time_ - now_.start > options_.verb_timeout;
}

void Executive::Impl::EnterReach(const planning::ReachVerb& verb) {
  now_.entered = true;
  now_.start = time_;
  now_.progress_time = time_;
  now_.speed = verb.speed;
  now_.transit = IsFreeMotion();
  SwitchFrame(step().target);
  if (verb_ == step().first_reach && PutsDown()) FindFreePlace();
  const math::Pose X_WT = X_WF(frame_);
  if (step().tool == kNone) {
    X_ToolHand_ = turned_ ? HalfTurn() : math::Pose();
  } else {
    X_ToolHand_ = math::Between(X_WO(step().tool), X_WH_);
  }
  const math::Pose X_TTool = ToolGoal(verb);
  const math::Pose X_BTool = math::Between(X_WB_, X_WT * X_TTool);
  // Turning the hand would turn what it holds.
  const bool choose = step().tool == kNone && held_ == kNone && !step().push && verb_ == step().first_reach;
  const math::Pose candidates[] = {choose ? X_BTool : X_BTool * X_ToolHand_, X_BTool * HalfTurn()};
  posture_search_.Start(state_.q(), candidates, choose ? 2 : 1, recovering_ ? nullptr : &plan_step().q);
  now_.phase = choose ? 0 : 1;

  now_.X_TH_start = reference_.X_TR();
  if (step().push) EnterPush();
  const Eigen::Vector3d path = (X_TTool * X_ToolHand_).p - reference_.X_TR().p;
  const bool moves = path.norm() > 0.002;
  now_.approach_T = moves ? Eigen::Vector3d(path.normalized()) : Eigen::Vector3d(-X_WT.R.row(2).transpose());
  contact_.Start();

  // The last of several reaches of a step is an approach along the line from the pose before.
  const auto* before =
      verb_ > 0 ? std::get_if<planning::ReachVerb>(&verbs()[static_cast<size_t>(verb_ - 1)]) : nullptr;
  if (before == nullptr || step().push) return;
  const Eigen::Vector3d stretch = (X_TTool * X_ToolHand_).p - (ToolGoal(*before) * X_ToolHand_).p;
  if (stretch.norm() < 0.005) return;
  now_.funnel_length = stretch.norm();
  now_.funnel_T = stretch.normalized();
}

bool Executive::Impl::OutOfReach(const math::Pose& X_TH) const {
  const robot::Reach& reach = model_->reach();
  const math::Pose X_BH = math::Between(X_WB_, X_WF(frame_) * X_TH);
  return (X_BH * reach.wrist_hand - reach.centre).norm() > reach.max + kBeyondReach;
}

Outcome Executive::Impl::Run(const planning::ReachVerb& verb) {
  if (step().tool != kNone && held_ != step().tool) {
    const std::string name = scene_.objects[static_cast<size_t>(step().tool)].name;
    const int resume = step().grasp_step == kNone ? step_ : step().grasp_step;
    Abort(EventKind::kGraspLost, "'" + name + "' is not in the hand", resume, true);
    return Outcome::kAborted;
  }
  if (step().push && now_.phase == 2) return FinishPush();
  if (!now_.entered) EnterReach(verb);
  if (now_.phase == 0) {
    if (!posture_search_.done()) return Outcome::kRunning;
    turned_ = posture_search_.best() == 1;
    X_ToolHand_ = turned_ ? HalfTurn() : math::Pose();
    now_.phase = 1;
  }
  if (step().tool != kNone && !verb.until_contact) {
    const math::Pose measured = math::Between(X_WO(step().tool), X_WH_);
    X_ToolHand_ = Blend(X_ToolHand_, measured, std::min(1.0, options_.period / kSlipTime));
  }
  if (step().push) return RunPush(verb);
  const math::Pose X_TTool = ToolGoal(verb);
  now_.X_TG = X_TTool * X_ToolHand_;
  if (OutOfReach(now_.X_TG)) {
    Abort(EventKind::kStalled, "'" + plan_step().target + "' is where the arm can't reach the pose", step_,
          false);
    return Outcome::kAborted;
  }
  const auto [position_error, rotation_error] = ToolError(X_TTool);
  records_[static_cast<size_t>(step_)].position_error = position_error;
  records_[static_cast<size_t>(step_)].rotation_error = rotation_error;
  if (verb.until_contact) return ReachUntilContact(verb, position_error, rotation_error);

  const bool arrived =
      (reference_.X_TR().p - now_.X_TG.p).norm() < std::max(kArrived, 0.2 * verb.position_tolerance) &&
      math::AngleBetween(reference_.X_TR().R, now_.X_TG.R) <
          std::max(kArrivedAngle, 0.2 * verb.rotation_tolerance);
  const math::Vector6d V_WT = V_WF(frame_);
  const Eigen::Vector3d v_rest = V_WT.head<3>() + V_WT.tail<3>().cross(X_WH_.p - X_WF(frame_).p);
  const bool slow = (V_WH_.head<3>() - v_rest).norm() < std::min(kSlow, kSlowRate * verb.position_tolerance);
  const bool there = position_error < verb.position_tolerance && rotation_error < verb.rotation_tolerance;
  if (arrived && slow && there) return Outcome::kDone;

  if (!Stalled(position_error + 0.2 * rotation_error)) return Outcome::kRunning;
  const std::string where = Millimetres(position_error) + " from its pose";
  if (position_error < std::max(kNearlyThere, verb.position_tolerance) &&
      rotation_error < std::max(kNearlyThereAngle, verb.rotation_tolerance)) {
    Record(EventKind::kStalled, "the reach ends " + where);
    return Outcome::kDone;
  }
  if (now_.transit && (reference_.X_TR().p - now_.X_TG.p).norm() > kShiftTolerance) {
    // Passing above the obstructions is out of reach: the straight motion is tried.
    Record(EventKind::kClearance, "passing above the obstructions is out of reach: the hand goes straight");
    now_.transit = false;
    now_.progress_time = time_;
    return Outcome::kRunning;
  }
  Abort(EventKind::kStalled, "the reach stalled " + where, step_, step().tool == kNone);
  return Outcome::kAborted;
}

Outcome Executive::Impl::ReachUntilContact(const planning::ReachVerb& verb, double position_error,
                                           double rotation_error) {
  const math::Pose X_WT = X_WF(frame_);
  const math::Pose X_TH_goal = now_.X_TG;
  now_.X_TG.p += options_.contact_search * now_.approach_T;
  force_W_ = X_WB_.R * HandWrench(state_, tau_external_).head<3>();
  const bool felt = contact_.Update(force_W_, X_WT.R * now_.approach_T, options_.period);
  const bool stalled = Stalled(position_error + 0.2 * rotation_error);
  const bool arrived =
      (reference_.X_TR().p - now_.X_TG.p).norm() < kArrived && V_WH_.head<3>().norm() < kSlow;
  if (!felt && !stalled && !arrived) return Outcome::kRunning;

  const math::Pose X_TH = math::Between(X_WT, X_WH_);
  const double ahead = (X_TH_goal.p - X_TH.p).dot(now_.approach_T);
  const double limit = std::max(kEarlyContact, verb.position_tolerance);
  if (ahead > limit) {
    Abort(EventKind::kStalled, "contact " + Millimetres(ahead) + " before the pose", step_,
          step().tool == kNone);
    return Outcome::kAborted;
  }
  if (felt) {
    Record(EventKind::kContact, Millimetres(ahead) + " before the pose");
    ResetReferenceToHand();
  } else {
    Record(EventKind::kNoContact, "the reach ends at its pose");
  }
  return Outcome::kDone;
}

Outcome Executive::Impl::Run(const planning::ShiftVerb& verb) {
  if (!now_.entered) {
    Hold();
    now_.entered = true;
    now_.start = time_;
    now_.progress_time = time_;
    now_.speed = verb.speed;
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    if (verb.in == In::kTarget) R = X_WF(step().target).R;
    if (verb.in == In::kHand || (verb.in == In::kControl && step().control == kNone)) R = reference_.X_TR().R;
    if (verb.in == In::kControl && step().control != kNone) R = X_WO(step().control).R;
    now_.X_TG.p += R * verb.by;
  }
  GoAlong();
  const math::Pose X_WT = X_WF(frame_);
  const math::Vector6d V_WT = V_WF(frame_);
  const double error = (X_WH_.p - X_WT * now_.X_TG.p).norm();
  const bool arrived = (reference_.X_TR().p - now_.X_TG.p).norm() < 0.2 * kShiftTolerance;
  const Eigen::Vector3d v_rest = V_WT.head<3>() + V_WT.tail<3>().cross(X_WH_.p - X_WT.p);
  if (arrived && error < kShiftTolerance && (V_WH_.head<3>() - v_rest).norm() < 2 * kSlow)
    return Outcome::kDone;
  if (!Stalled(error)) return Outcome::kRunning;
  Record(EventKind::kStalled, "the shift ends " + Millimetres(error) + " from where it led");
  ResetReferenceToHand();
  return Outcome::kDone;
}

Outcome Executive::Impl::Run(const planning::GripperVerb& verb) {
  const double max_opening = model_->gripper().max_opening;
  const bool open = verb.close_on.empty();
  if (!now_.entered) {
    Hold();
    GoAlong();
    now_.entered = true;
    now_.start = time_;
    now_.last_opening = opening_;
    if (open) {
      gripper_.mode = robot::GripperCommand::Mode::kOpening;
      gripper_.opening = max_opening;
      if (held_ != kNone)
        Record(EventKind::kReleased, "'" + scene_.objects[static_cast<size_t>(held_)].name + "'");
      held_ = kNone;
    } else {
      gripper_.mode = robot::GripperCommand::Mode::kForce;
      gripper_.force = std::min(verb.force, model_->gripper().max_force);
    }
  }
  // Fingers that close on something move it: the hand does not follow that motion.
  if (open) GoAlong();
  now_.quiet_time += options_.period;
  if (std::abs(opening_ - now_.last_opening) > kSettledOpening) {
    now_.last_opening = opening_;
    now_.quiet_time = 0;
  }
  const double elapsed = time_ - now_.start;
  if (open) {
    const bool wide = opening_ > max_opening - 0.002;
    const bool settled = now_.quiet_time > kSettledTime && elapsed > 2 * kSettledTime;
    return wide || settled || elapsed > kGripperTimeout ? Outcome::kDone : Outcome::kRunning;
  }
  const bool settled = now_.quiet_time > kSettledTime && elapsed > 2 * kSettledTime;
  if (!settled && elapsed < kGripperTimeout) return Outcome::kRunning;
  const int object = step().close_on[static_cast<size_t>(verb_)];
  const std::string name = "'" + scene_.objects[static_cast<size_t>(object)].name + "'";
  const std::string wrong =
      WrongWidth(opening_, scene_.objects[static_cast<size_t>(object)].shape,
                 math::Between(X_WH_, X_WO(object)), model_->gripper(), options_.least_width);
  if (!wrong.empty()) {
    Abort(EventKind::kGraspMissed, "the gripper closed on " + wrong + " instead of " + name, step_, true);
    return Outcome::kAborted;
  }
  held_ = object;
  held_width_ = opening_;
  FindCarried();
  held_since_ = time_;
  lost_time_ = 0;
  X_HO_grasp_ = math::Between(X_WH_, X_WO(object));
  Record(EventKind::kGrasped, name + ", " + Millimetres(opening_) + " wide");
  return Outcome::kDone;
}

Outcome Executive::Impl::Run(const planning::WaitVerb& verb) {
  if (!now_.entered) {
    Hold();
    now_.entered = true;
    now_.start = time_;
  }
  GoAlong();
  return time_ - now_.start >= verb.seconds ? Outcome::kDone : Outcome::kRunning;
}

}  // namespace tether::execution
