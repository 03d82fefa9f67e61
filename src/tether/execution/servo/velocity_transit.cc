// Transits of the whole arm, followed by velocities.

#include <algorithm>
#include <variant>

#include "tether/execution/servo/velocity_servo.h"

namespace tether::execution {
namespace {

using math::Pose;

// The path waits for joints that lag behind by more than this, rad.
constexpr double kLag = 0.06;

}  // namespace

// Where the plan has a motion. Only clearances and tilts are looked at along a path: where other constraints
// hold for frames or the verb, the hand goes straight, under these.
bool VelocityServo::IsFreeMotion(const planning::ReachVerb& reach) const {
  const auto moves = [](const planning::Verb& verb) {
    return std::holds_alternative<planning::ReachVerb>(verb) ||
           std::holds_alternative<planning::ShiftVerb>(verb);
  };
  const auto begin = s_.verbs().begin();
  return !drive_ && s_.plan_step().motion && !s_.recovering && transits_ < kMostTransits &&
         std::none_of(begin, begin + s_.verb, moves) && !schema().target_is_region && !reach.until_contact &&
         reach.objective.empty() && s_.current().specs[s_.verb].empty() && !has_fields_;
}

Pose VelocityServo::HandGoal(const planning::ReachVerb& reach, const Pose& X_TC) const {
  const Pose X_WT = X_WTarget(control_scene_.Target(schema().target));
  // As it was grasped: where a moving object is seen lags behind.
  const Pose X_FH = s_.current().control == kNone ? Pose() : s_.X_HO_grasp.Inverse();
  Pose X_TF = X_TC;
  if (reach.in == planning::In::kHand) {
    X_TF.p += (X_TC * X_FH).R * reach.offset;  // As the hand will be, not as it is now.
  } else {
    X_TF = Offset(reach.offset, reach.in, X_TC, X_WT);
  }
  return math::Between(s_.X_WB, X_WT * X_TF * X_FH);
}

void VelocityServo::BeginTransit(const planning::ReachVerb& reach) {
  Progress missing;
  const std::optional<Pose> X_TC = KeyPose(&missing);
  if (!X_TC || !IsFreeMotion(reach)) return;
  ++transits_;
  X_BGoal_ = HandGoal(reach, *X_TC);
  const Pose X_BH = math::Between(s_.X_WB, s_.X_WH);
  if (IsNearForTransit(X_BH, X_BGoal_)) return;
  motion::TransitGoal goal{X_BGoal_, {}, {}};
  for (size_t i = ToIndex(s_.verb + 1); i < s_.verbs().size(); ++i) {
    if (const auto* next = std::get_if<planning::ReachVerb>(&s_.verbs()[i]))
      goal.then.push_back(HandGoal(*next, *X_TC));
  }
  goal.near = s_.plan_step().q;
  const auto begin = [&] {
    const std::optional<planning::StepMotion>& planned = s_.plan_step().motion;
    return transit_.Begin(
        s_.q, s_.v, {goal}, [this](ObjectId object) { return object == s_.held; },
        planned ? &planned->path : nullptr);
  };
  bool found = begin();
  if (!found && transit_.status() == motion::PathStatus::kNoFreeGoal) {
    // Where what is held touches something at the goal, the path ends above.
    motion::EndAbove(goal, s_.X_WB.R.row(2));
    found = begin();
  }
  s_.Record(found ? EventKind::kTransit : EventKind::kClearance,
            found ? transit_.Describe() : "no path of the arm was found: " + transit_.why());
}

Progress VelocityServo::FollowTransit(const planning::ReachVerb& reach) {
  if (transit_.done() || transit_.at_rest()) {
    // The reach begins anew: where the path was left, perhaps along another one.
    const bool done = transit_.done();
    transit_.Stop();
    entered_ = false;
    if (done) transits_ = kMostTransits;
    return Progress::Running();
  }
  if (!transit_.braking()) {
    Progress missing;
    const std::optional<Pose> X_TC = KeyPose(&missing);
    const Pose X_BG = X_TC ? HandGoal(reach, *X_TC) : X_BGoal_;
    if (HasMovedForTransit(X_BG, X_BGoal_) || !transit_.IsFreeAhead()) transit_.Brake();
  }
  const double lag = (s_.q - transit_.joints().q).cwiseAbs().maxCoeff();
  transit_.Advance(shared_.period, std::clamp(2 - lag / kLag, 0.0, 1.0));
  const motion::JointReference& joints = transit_.joints();
  // The controller moves joints by its gain times what they lack: so much further they are asked to be.
  if (!goal_ || goal_->posture.size() == 0) goal_ = control::Goal{};
  goal_->posture = joints.q + joints.v / options_.controller.gain;
  goal_->turn_speed = s_.model->max_velocity().maxCoeff();
  watch_.Observe((transit_.end() - s_.q).cwiseAbs().maxCoeff(), s_.time);
  if (!watch_.Stalled(s_.time)) return Progress::Running();
  transit_.Stop();
  transits_ = kMostTransits;
  entered_ = false;
  goal_.reset();
  watch_.Excuse(s_.time);
  s_.Record(EventKind::kStalled, "on the path, " + WhatHoldsUp());
  return Progress::Running();
}

}  // namespace tether::execution
