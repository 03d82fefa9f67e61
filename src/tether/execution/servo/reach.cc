#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "tether/execution/servo/reference_servo.h"

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
// Beyond the proved bound of the reach by this, a pose is not tried, m.
constexpr double kBeyondReach = 0.01;
// Without progress for so long, it is asked whether the arm can reach the pose at all, s; and again once the
// pose has moved by this, m and rad.
constexpr double kAskAfter = 0.4;
constexpr double kMoved = 0.02, kTurned = 0.1;
// A hand that moves faster than this relative to its target has not stalled, m/s and rad/s.
constexpr double kMoving = 0.01, kTurning = 0.05;
// A reference this near to the line of its approach is on it, m.
constexpr double kAligned = 0.004;
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

// Where a path has ended a reach is done this near, m and rad.
constexpr double kPathEnd = 0.006, kPathEndAngle = 0.03;

}  // namespace

bool ReferenceServo::IsFreeMotion() const {
  if (s_.recovering || s_.current().push || s_.verb != s_.current().first_reach) return false;
  const auto* reach = std::get_if<planning::ReachVerb>(&s_.present_verb());
  return reach != nullptr && !reach->until_contact;
}

void ReferenceServo::Hold() {
  SwitchFrame({});
  now_.transit = false;
}

math::Pose ReferenceServo::ToolGoal(const planning::ReachVerb& verb) const {
  math::Pose X_TC = X_TC_;
  switch (verb.in) {
    case In::kControl:
      X_TC = X_TC * math::Pose(verb.offset);
      break;
    case In::kTarget:
      X_TC.p += verb.offset;
      break;
    case In::kHand:
      X_TC.p += (X_TC * s_.current().X_CTool * X_ToolHand_).R * verb.offset;
      break;
    case In::kWorld:
      X_TC.p += X_WF(s_.current().target).R.transpose() * verb.offset;
      break;
  }
  return X_TC * s_.current().X_CTool;
}

std::pair<double, double> ReferenceServo::ToolError(const math::Pose& X_TTool_goal) const {
  const math::Pose X_TTool = math::Between(X_WF(frame_), s_.X_WH * X_ToolHand_.Inverse());
  return {(X_TTool.p - X_TTool_goal.p).norm(), math::AngleBetween(X_TTool.R, X_TTool_goal.R)};
}

math::Vector6d ReferenceServo::HandVelocity() const {
  math::Vector6d V = V_WF(frame_);
  V.head<3>() += V.tail<3>().cross(s_.X_WH.p - X_WF(frame_).p);
  return s_.V_WH - V;
}

// The measured hand counts, not the reference: that may go on while something holds the hand up.
bool ReferenceServo::Stalled(double error) {
  const math::Vector6d V = HandVelocity();
  watch_.Observe(error, s_.time, V.head<3>().norm() > kMoving || V.tail<3>().norm() > kTurning);
  return watch_.Stalled(s_.time);
}

void ReferenceServo::EnterReach(const planning::ReachVerb& verb) {
  now_.entered = true;
  watch_.Start(s_.time);
  now_.speed = verb.speed;
  now_.transit = IsFreeMotion();
  SwitchFrame(s_.current().target);
  if (s_.verb == s_.current().first_reach && PutsDown()) FindFreePlace();
  const math::Pose X_WT = X_WF(frame_);
  if (s_.current().tool == kNone) {
    X_ToolHand_ = turned_ ? HalfTurn() : math::Pose();
  } else {
    X_ToolHand_ = math::Between(X_WO(s_.current().tool), s_.X_WH);
  }
  const math::Pose X_TTool = ToolGoal(verb);
  const math::Pose X_BTool = math::Between(s_.X_WB, X_WT * X_TTool);
  // Turning the hand would turn what it holds.
  const bool choose = s_.current().tool == kNone && s_.held == kNone && !s_.current().push &&
                      s_.verb == s_.current().first_reach;
  const math::Pose candidates[] = {choose ? X_BTool : X_BTool * X_ToolHand_, X_BTool * HalfTurn()};
  posture_search_.Start(state_.q(), candidates, choose ? 2 : 1, s_.recovering ? nullptr : &s_.plan_step().q);
  now_.phase = choose ? 0 : 1;

  now_.X_TH_start = reference_.X_TR();
  if (s_.current().push) EnterPush();
  if (IsFreeMotion()) BeginTransit(verb, s_.q, s_.v);
  const Eigen::Vector3d path = (X_TTool * X_ToolHand_).p - reference_.X_TR().p;
  const bool moves = path.norm() > 0.002;
  now_.approach_T = moves ? Eigen::Vector3d(path.normalized()) : Eigen::Vector3d(-X_WT.R.row(2).transpose());
  contact_.Start();

  // The last of several reaches of a step is an approach along the line from the pose before.
  const auto* before =
      s_.verb > 0 ? std::get_if<planning::ReachVerb>(&s_.verbs()[ToIndex(s_.verb - 1)]) : nullptr;
  if (before == nullptr || s_.current().push) return;
  const Eigen::Vector3d stretch = (X_TTool * X_ToolHand_).p - (ToolGoal(*before) * X_ToolHand_).p;
  if (stretch.norm() < 0.005) return;
  now_.funnel_length = stretch.norm();
  now_.funnel_T = now_.approach_T = stretch.normalized();
}

// Whether no joint positions within their limits bring the hand there: proved by the lengths of the links, or
// what a search says that is made once there is no progress.
bool ReferenceServo::OutOfReach(const math::Pose& X_TH) {
  const math::Pose X_BH = math::Between(s_.X_WB, X_WF(frame_) * X_TH);
  const robot::OuterReach& outer = s_.model->outer_reach();
  lacking_ = (X_BH * outer.p_HW - outer.centre).norm() - outer.radius;
  if (lacking_ > kBeyondReach) return true;
  const bool elsewhere = (reach_search_.X_BH().p - X_BH.p).norm() > kMoved ||
                         math::AngleBetween(reach_search_.X_BH().R, X_BH.R) > kTurned;
  if (elsewhere) reach_search_.Stop();
  const bool known = s_.in_plan() && s_.plan_step().q.size() == s_.q.size();
  if (reach_search_.state() == ReachSearch::State::kIdle && watch_.quiet(s_.time) > kAskAfter)
    reach_search_.Start(X_BH, s_.q, known ? s_.plan_step().q : s_.q);
  reach_search_.Advance();
  lacking_ = reach_search_.nearest_m();
  return reach_search_.state() == ReachSearch::State::kOutOfReach;
}

Progress ReferenceServo::BeyondReach(int resume) {
  now_.X_TG = reference_.X_TR();
  Progress progress = Progress::Retry(EventKind::kStalled,
                                      "'" + s_.plan_step().target +
                                          "' is where the arm can't reach the pose: within its joints' "
                                          "limits the hand comes no nearer than " +
                                          Length(lacking_),
                                      resume, false);
  progress.out_of_reach = true;
  return progress;
}

Progress ReferenceServo::Reach(const planning::ReachVerb& verb) {
  if (s_.current().tool != kNone && s_.held != s_.current().tool) {
    const std::string name = s_.object(s_.current().tool).name;
    const int resume = s_.current().grasp_step == kNoStep ? s_.step : s_.current().grasp_step;
    return Progress::Retry(EventKind::kGraspLost, "'" + name + "' is not in the hand", resume, true);
  }
  if (s_.current().push && now_.phase == 2) return FinishPush();
  if (!now_.entered) EnterReach(verb);
  if (now_.phase == 0) {
    if (!posture_search_.done()) return Progress::Running();
    turned_ = posture_search_.best() == 1;
    X_ToolHand_ = turned_ ? HalfTurn() : math::Pose();
    now_.phase = 1;
  }
  if (s_.current().tool != kNone && !verb.until_contact) {
    const math::Pose measured = math::Between(X_WO(s_.current().tool), s_.X_WH);
    X_ToolHand_ = Blend(X_ToolHand_, measured, std::min(1.0, shared_.period / kSlipTime));
  }
  if (s_.current().push) return RunPush(verb);
  const math::Pose X_TTool = ToolGoal(verb);
  now_.X_TG = X_TTool * X_ToolHand_;
  WatchTransit(verb);
  if (OutOfReach(now_.X_TG)) return BeyondReach(s_.step);
  const auto [position_error, rotation_error] = ToolError(X_TTool);
  s_.records[s_.step].position_error = position_error;
  s_.records[s_.step].rotation_error = rotation_error;
  if (verb.until_contact) return ReachUntilContact(verb, position_error, rotation_error);

  const bool arrived =
      (reference_.X_TR().p - now_.X_TG.p).norm() < std::max(kArrived, 0.2 * verb.position_tolerance) &&
      math::AngleBetween(reference_.X_TR().R, now_.X_TG.R) <
          std::max(kArrivedAngle, 0.2 * verb.rotation_tolerance);
  const bool slow = HandVelocity().head<3>().norm() < std::min(kSlow, kSlowRate * verb.position_tolerance);
  const bool there = position_error < verb.position_tolerance && rotation_error < verb.rotation_tolerance;
  if ((arrived && slow && there) || TurnsIntoApproach()) return Progress::Done();
  // At the end of its path the arm is at rest but for what the controller lags: the next motion takes that
  // up.
  if (path_ended_ && position_error < std::max(kPathEnd, verb.position_tolerance) &&
      rotation_error < std::max(kPathEndAngle, verb.rotation_tolerance) &&
      s_.verb + 1 < static_cast<int>(s_.verbs().size()))
    return Progress::Done();

  if (!Stalled(position_error + 0.2 * rotation_error)) return Progress::Running();
  const bool turned = rotation_error > verb.rotation_tolerance;
  const std::string where = Deviation(position_error, turned ? rotation_error : 0) + " from its pose";
  if (position_error < std::max(kNearlyThere, verb.position_tolerance) &&
      rotation_error < std::max(kNearlyThereAngle, verb.rotation_tolerance)) {
    s_.Record(EventKind::kStalled, "the reach ends " + where);
    return Progress::Done();
  }
  if (now_.transit && (reference_.X_TR().p - now_.X_TG.p).norm() > kShiftTolerance) {
    // Passing above the obstructions is out of reach: the straight motion is tried.
    s_.Record(EventKind::kClearance,
              "passing above the obstructions is out of reach: the hand goes straight");
    now_.transit = false;
    watch_.Excuse(s_.time);
    return Progress::Running();
  }
  return Progress::Retry(EventKind::kStalled, "the reach stalled " + where + WhatHoldsUp(), s_.step,
                         s_.current().tool == kNone);
}

Progress ReferenceServo::ReachUntilContact(const planning::ReachVerb& verb, double position_error,
                                           double rotation_error) {
  const math::Pose X_WT = X_WF(frame_);
  const math::Pose X_TH_goal = now_.X_TG;
  now_.X_TG.p += options_.contact_search * now_.approach_T;
  force_W_ = s_.X_WB.R * HandWrench(state_, s_.tau_external).head<3>();
  if (!now_.aligned) {
    // What is felt while the hand turns into the approach is its own inertia.
    const Eigen::Vector3d offset = reference_.X_TR().p - X_TH_goal.p;
    now_.aligned =
        now_.funnel_length == 0 || (offset - now_.funnel_T * now_.funnel_T.dot(offset)).norm() < kAligned;
    contact_.Start();
  }
  const bool felt = contact_.Update(force_W_, X_WT.R * now_.approach_T, shared_.period);
  const bool stalled = Stalled(position_error + 0.2 * rotation_error);
  const bool arrived =
      (reference_.X_TR().p - now_.X_TG.p).norm() < kArrived && s_.V_WH.head<3>().norm() < kSlow;
  if (!felt && !stalled && !arrived) return Progress::Running();

  const math::Pose X_TH = math::Between(X_WT, s_.X_WH);
  const double ahead = (X_TH_goal.p - X_TH.p).dot(now_.approach_T);
  const double limit = std::max(kEarlyContact, verb.position_tolerance);
  if (ahead > limit) {
    const std::string what = felt ? "contact " : "the reach stalled ";
    return Progress::Retry(EventKind::kStalled,
                           what + Length(ahead) + " before the pose" + (felt ? "" : WhatHoldsUp()), s_.step,
                           s_.current().tool == kNone);
  }
  if (felt) {
    s_.Record(EventKind::kContact, Length(ahead) + " before the pose");
    ResetReferenceToHand();
  } else {
    s_.Record(EventKind::kNoContact, "the reach ends at its pose");
  }
  return Progress::Done();
}

Progress ReferenceServo::Shift(const planning::ShiftVerb& verb) {
  if (!now_.entered) {
    Hold();
    now_.entered = true;
    watch_.Start(s_.time);
    now_.speed = verb.speed;
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    if (verb.in == In::kTarget) R = X_WF(s_.current().target).R;
    if (verb.in == In::kHand || (verb.in == In::kControl && s_.current().control == kNone))
      R = reference_.X_TR().R;
    if (verb.in == In::kControl && s_.current().control != kNone) R = X_WO(s_.current().control).R;
    now_.X_TG.p += R * verb.by;
    now_.length = verb.by.norm();
  }
  GoAlong();
  const double error = (s_.X_WH.p - X_WF(frame_) * now_.X_TG.p).norm();
  const bool arrived = (reference_.X_TR().p - now_.X_TG.p).norm() < 0.2 * kShiftTolerance;
  if (arrived && error < kShiftTolerance && HandVelocity().head<3>().norm() < 2 * kSlow)
    return Progress::Done();
  if (TurnsIntoTransit(error)) return Progress::Done();
  if (!Stalled(error)) return Progress::Running();
  s_.Record(EventKind::kStalled, "the shift ends " + Length(error) + " from where it led" + WhatHoldsUp());
  ResetReferenceToHand();
  return Progress::Done();
}

}  // namespace tether::execution
