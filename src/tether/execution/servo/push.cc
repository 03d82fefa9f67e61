#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tether/common/text.h"
#include "tether/execution/servo/reference_servo.h"
#include "tether/geometry/distance/distance.h"
#include "tether/geometry/least_turn.h"
#include "tether/robot/gravity.h"

namespace tether::execution {
namespace {

using Eigen::Vector3d;

// The object is led back to the straight line to its place within about this length, m.
constexpr double kLookAhead = 0.025;
// Contacts creep sideways under a steady load: the correction is learned at this rate, 1/s.
constexpr double kDriftRate = 1.0;
// The reference advances by this share of the object's remaining error per second, 1/s: slowly enough that
// nothing is pushed beyond its place, from where no tool could pull it back.
constexpr double kPushRate = 4;
constexpr double kReferenceRate = 12;  // 1/s, of PoseReference
// This near along the push the object is at its place, m; a longer push goes on to the middle of what is
// allowed.
constexpr double kThere = 0.0005;
// The share of the friction angle within which the direction of pressing stays.
constexpr double kConeShare = 0.7;
constexpr double kLeastFriction = 0.1;
// A correction turns an object by no more than this per distance pushed, rad/m.
constexpr double kTurnPerDistance = 25;
// Tool and object further apart than this don't define the direction of pressing, m.
constexpr double kApart = 0.02;
// A pusher that moved this far without the object has lost it.
constexpr double kPushSlack = 0.06;  // m
constexpr double kPushShare = 0.3;
// The tool backs off by this before anything else happens: what rises along a side drags it along, m.
constexpr double kBackOff = 0.01;
constexpr double kBackOffTime = 1.0;  // s, at most

// The fingers hold a tool harder by this many times what the object's friction may press it with.
constexpr double kGrip = 3;

// What the plan has the fingers close with, N.
double PlannedForce(const planning::PlanStep& grasp) {
  double force = 0;
  for (const planning::Verb& verb : grasp.execute) {
    const auto* gripper = std::get_if<planning::GripperVerb>(&verb);
    if (gripper != nullptr && !gripper->close_on.empty()) force = gripper->force;
  }
  return force;
}

Vector3d Level(const Vector3d& v_W) { return {v_W.x(), v_W.y(), 0}; }

}  // namespace

void ReferenceServo::EnterPush() {
  const math::Pose X_WT = X_WF(frame_);
  const math::Pose& X_WC = X_WO(s_.current().control);
  now_.X_TC_start = math::Between(X_WT, X_WC);
  const scene::Object& object = s_.object(s_.current().control);
  const bool hand = s_.current().tool == kNone;
  const geometry::Shape& tool = hand ? hand_shape_ : s_.object(s_.current().tool).shape;
  const geometry::Distance touch =
      geometry::SignedDistance(tool, hand ? s_.X_WH : X_WO(s_.current().tool), object.shape, X_WC);
  // Along the normal where they touch; from afar, along the motion.
  Vector3d normal_W = Level(X_WT.R * (s_.plan_step().X_TC.p - now_.X_TC_start.p));
  if (const Vector3d n_W = Level(touch.n_W); touch.distance < kApart && n_W.norm() > 0.5) normal_W = n_W;
  if (normal_W.norm() < 1e-9) normal_W = Level(X_WC.p - s_.X_WH.p);
  now_.normal_C = X_WC.R.transpose() * normal_W.normalized();
  double friction = object.friction;
  if (!hand) friction = std::min(friction, s_.object(s_.current().tool).friction);
  if (!hand && s_.current().grasp_step != kNoStep) {
    const double force = PlannedForce(s_.plan_step(s_.current().grasp_step)) +
                         kGrip * object.friction * object.mass.value_or(0) * robot::kGravity;
    s_.gripper.force = std::min(force, s_.model->gripper().max_force);
  }
  now_.slope = std::tan(kConeShare * std::atan(std::max(friction, kLeastFriction)));
}

// The object follows the straight line from where it stood to its place. At each tick the tool's reference
// moves by the object's remaining error, which makes up for slip of the tool, for the arm's compliance under
// the load, and for turning of the object. The direction stays within the friction cone about the contact's
// normal, and turning is bounded by the distance pushed, so that corrections end where the push does. Lynch
// and Mason, "Stable pushing" (1996): within these bounds the object keeps its contact with a line or a face.
Progress ReferenceServo::RunPush(const planning::ReachVerb& verb) {
  if (PushSlips()) {
    return Progress::Retry(EventKind::kPushSlipped,
                           "'" + s_.plan_step().control + "' does not move with its pusher",
                           s_.current().action_start, false);
  }
  const math::Pose X_WT = X_WF(frame_);
  const math::Pose X_TC = math::Between(X_WT, X_WO(s_.current().control));
  const math::Pose& X_TC_goal = s_.plan_step().X_TC;
  const Vector3d line = X_TC_goal.p - now_.X_TC_start.p;
  const double length = line.norm();
  const Vector3d u = length > 1e-6 ? Vector3d(line / length) : Vector3d(X_TC.R * now_.normal_C);
  StepRecord& record = s_.records[s_.step];
  record.position_error = (X_TC.p - X_TC_goal.p).norm();
  record.rotation_error = TurnLeft(X_TC).norm();

  // What the object lacks: to a point of the line ahead of it, and in angle.
  const double ahead = std::min(length, (X_TC.p - now_.X_TC_start.p).dot(u) + kLookAhead);
  const Vector3d lack = now_.X_TC_start.p + ahead * u - X_TC.p;
  const Vector3d n = X_TC.R * now_.normal_C;
  const double forward = lack.dot(n);
  if (forward <= kThere) {
    now_.phase = 2;
    now_.entered = false;
    return Progress::Running();
  }
  Vector3d beside = lack - forward * n;
  beside -= X_WT.R.row(2).transpose() * X_WT.R.row(2).dot(beside);  // it stays on its surface
  Vector3d off = now_.X_TC_start.p - X_TC.p;  // the shortest displacement back to the line
  off -= u * u.dot(off);
  now_.drift_T += kDriftRate * shared_.period * (off - n * n.dot(off));
  if (const double most = now_.slope * kLookAhead; now_.drift_T.norm() > most)
    now_.drift_T *= most / now_.drift_T.norm();
  beside += std::min(1.0, forward / kLookAhead) * now_.drift_T;
  if (const double most = now_.slope * forward; beside.norm() > most) beside *= most / beside.norm();
  Vector3d turn = TurnLeft(X_TC);
  if (const double most = kTurnPerDistance * forward; turn.norm() > most) turn *= most / turn.norm();

  const double share = kPushRate / kReferenceRate;
  const math::Pose& X_TR = reference_.X_TR();
  const Eigen::Matrix3d R = math::ExpSO3(share * turn);
  now_.X_TG.R = R * X_TR.R;
  now_.X_TG.p = X_TC.p + share * (forward * n + beside) + R * (X_TR.p - X_TC.p);
  now_.speed = verb.speed;
  if (OutOfReach(now_.X_TG)) return BeyondReach(s_.current().action_start);

  // The reference moves as long as something is lacking: only the object tells of progress.
  const double left = (X_TC.p - X_TC_goal.p).norm();
  watch_.Observe(left, s_.time);
  if (!watch_.Stalled(s_.time)) return Progress::Running();
  if (left <= options_.push_limit) {
    s_.Record(EventKind::kStalled, "the push ends " + Length(left) + " from its pose");
    now_.phase = 2;
    now_.entered = false;
    return Progress::Running();
  }
  return Progress::Retry(EventKind::kStalled,
                         "the push stalled " + Length(left) + " from its pose" + WhatHoldsUp(),
                         s_.current().action_start, false);
}

Vector3d ReferenceServo::TurnLeft(const math::Pose& X_TC) const {
  const geometry::Shape& shape = s_.object(s_.current().control).shape;
  return geometry::LeastTurn(shape, X_TC.R, s_.plan_step().X_TC.R);
}

bool ReferenceServo::PushSlips() const {
  const math::Pose X_TC = math::Between(X_WF(frame_), X_WO(s_.current().control));
  const double tool_way = (reference_.X_TR().p - now_.X_TH_start.p).norm();
  const double object_way = (X_TC.p - now_.X_TC_start.p).norm();
  return tool_way >= kPushSlack && object_way <= kPushShare * (tool_way - kPushSlack / 2);
}

// The tool backs off, then what became of the object is judged.
Progress ReferenceServo::FinishPush() {
  if (!now_.entered) {
    now_.entered = true;
    now_.start = s_.time;
    const Vector3d back_W = -(X_WO(s_.current().control).R * now_.normal_C);
    SwitchFrame({});
    ResetReferenceToHand();
    now_.X_TG.p += kBackOff * back_W;
    now_.speed = 0.05;
  }
  if (s_.current().tool != kNone && s_.current().grasp_step != kNoStep) {
    const double force = PlannedForce(s_.plan_step(s_.current().grasp_step));
    s_.gripper.force = std::min(force, s_.model->gripper().max_force);
  }
  const bool arrived = (reference_.X_TR().p - now_.X_TG.p).norm() < 0.001;
  if (!arrived && s_.time - now_.start < kBackOffTime) return Progress::Running();
  const math::Pose X_TC = math::Between(X_WF(s_.current().target), X_WO(s_.current().control));
  const math::Pose& X_TC_goal = s_.plan_step().X_TC;
  const Vector3d error = X_TC.p - X_TC_goal.p;
  const Vector3d path = X_TC_goal.p - now_.X_TC_start.p;
  const double along = path.norm() > 1e-6 ? error.dot(path.normalized()) : 0;
  const double lateral = std::sqrt(std::max(0.0, error.squaredNorm() - along * along));
  StepRecord& record = s_.records[s_.step];
  record.position_error = error.norm();
  record.rotation_error = TurnLeft(X_TC).norm();
  if (error.norm() <= options_.push_tolerance && record.rotation_error <= options_.push_angle)
    return Progress::Done();
  char degrees[32];
  FormatInto(degrees, sizeof degrees, "%.1f degrees", record.rotation_error * 180 / M_PI);
  const std::string text = "'" + s_.plan_step().control + "' ends " + Length(along) + " along and " +
                           Length(lateral) + " beside its pose, turned by " + degrees;
  const int action = s_.plan_step().action_index;
  // From before its pose it can be pushed on.
  const bool again = along < -options_.push_tolerance && s_.retries[action] < shared_.max_retries;
  if (error.norm() <= options_.push_limit && !again) {
    s_.Record(EventKind::kPushSlipped, text);
    return Progress::Done();
  }
  return Progress::Retry(EventKind::kPushSlipped, text, s_.current().action_start, false);
}

}  // namespace tether::execution
