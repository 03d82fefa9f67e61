#include <algorithm>
#include <cmath>
#include <numbers>

#include "tether/execution/servo/reference_servo.h"

namespace tether::execution {
namespace {

// This near to the end of a path the hand may turn into the approach, m and rad, if it lags by no more than
// this and has this room about it, m.
constexpr double kCorner = 0.03, kCornerTurn = 0.15, kCornerLag = 0.01, kCornerRoom = 0.04;
// So much of a shift may be cut off, m, and as a share of it.
constexpr double kCutOff = 0.02, kCutOffShare = 0.25;

const math::Pose& HalfTurn() {
  static const math::Pose turn(math::ExpSO3(Eigen::Vector3d(0, 0, std::numbers::pi)),
                               Eigen::Vector3d::Zero());
  return turn;
}

}  // namespace

void ReferenceServo::BeginTransit(const planning::ReachVerb& verb, const Eigen::VectorXd& from,
                                  const Eigen::VectorXd& velocity) {
  ++transits_;
  const math::Pose X_WT = X_WF(frame_);
  const bool choose = s_.current().tool == kNone && s_.held == kNone;
  const auto hand = [&](const planning::ReachVerb& reach, const math::Pose& X_ToolHand) {
    return math::Between(s_.X_WB, X_WT * ToolGoal(reach) * X_ToolHand);
  };
  const math::Pose X_BH = hand(verb, X_ToolHand_);
  if (IsNearForTransit(math::Between(s_.X_WB, s_.X_WH), X_BH)) return;
  std::vector<motion::TransitGoal> goals;
  const auto add = [&](const math::Pose& X_ToolHand, bool planned, bool above) {
    motion::TransitGoal goal{hand(verb, X_ToolHand), {}, {}};
    if (above) motion::EndAbove(goal, s_.X_WB.R.row(2));
    for (size_t i = static_cast<size_t>(s_.verb) + 1; i < s_.verbs().size(); ++i) {
      if (const auto* next = std::get_if<planning::ReachVerb>(&s_.verbs()[i]))
        goal.then.push_back(hand(*next, X_ToolHand));
    }
    if (planned) goal.near = s_.plan_step().q;
    goals.push_back(std::move(goal));
  };
  const auto begin = [&](bool above) {
    goals.clear();
    add(choose ? math::Pose() : X_ToolHand_, true, above);
    if (choose) add(HalfTurn(), false, above);
    const std::optional<planning::StepMotion>& planned = s_.plan_step().motion;
    return transit_.Begin(
        from, velocity, std::move(goals), [this](ObjectId object) { return MovesWithHand(object); },
        planned ? &planned->path : nullptr);
  };
  // Where what is held touches something at the goal, the path ends above.
  const bool found = begin(false) || (transit_.status() == motion::PathStatus::kNoFreeGoal && begin(true));
  if (!found) {
    s_.Record(EventKind::kClearance, "no path of the arm was found: " + transit_.why());
    return;
  }
  if (choose) {
    turned_ = transit_.goal() == 1;
    X_ToolHand_ = turned_ ? HalfTurn() : math::Pose();
    now_.phase = 1;
  }
  s_.Record(EventKind::kTransit, transit_.Describe());
  now_.X_TG = ToolGoal(verb) * X_ToolHand_;
  X_BGoal_ = hand(verb, X_ToolHand_);
  V_BR_.setZero();
}

void ReferenceServo::WatchTransit(const planning::ReachVerb& verb) {
  if (!transit_.active()) return;
  if (transit_.done()) {
    path_ended_ = true;
    return LeaveTransit();
  }
  if (!transit_.braking()) {
    const math::Pose X_BG = math::Between(s_.X_WB, X_WF(frame_) * now_.X_TG);
    if (HasMovedForTransit(X_BG, X_BGoal_) || !transit_.IsFreeAhead()) transit_.Brake();
    return;
  }
  if (!transit_.at_rest()) return;
  const Eigen::VectorXd from = transit_.joints().q;
  LeaveTransit();
  if (transits_ < kMostTransits) BeginTransit(verb, from, Eigen::VectorXd::Zero(from.size()));
}

void ReferenceServo::FollowTransit(double rate) {
  transit_.Advance(shared_.period, rate);
  const motion::JointReference& joints = transit_.joints();
  reference_arm_.Set(joints.q);
  reference_J_.resize(6, joints.q.size());
  reference_arm_.HandJacobian(reference_J_);
  const math::Vector6d V_BR = reference_J_ * joints.v;
  const math::Vector6d A_BR = (V_BR - V_BR_) / shared_.period;
  V_BR_ = V_BR;
  // In the frame of the target, whose motion is added again later.
  const math::Pose X_WT = X_WF(frame_);
  const math::Vector6d V_WT = V_WF(frame_);
  const math::Pose X_WR = s_.X_WB * reference_arm_.X_BH();
  const auto in_T = [&](const math::Vector6d& V, bool moving) {
    Eigen::Vector3d linear = s_.X_WB.R * V.head<3>(), angular = s_.X_WB.R * V.tail<3>();
    if (moving) {
      linear -= V_WT.head<3>() + V_WT.tail<3>().cross(X_WR.p - X_WT.p);
      angular -= V_WT.tail<3>();
    }
    math::Vector6d result;
    result << X_WT.R.transpose() * linear, X_WT.R.transpose() * angular;
    return result;
  };
  reference_.Reset(math::Between(X_WT, X_WR), in_T(V_BR, true), in_T(A_BR, false));
  posture_ = joints.q;
}

void ReferenceServo::LeaveTransit() {
  if (!transit_.active()) return;
  transit_.Stop();
  // The elbow stays where the path leads it.
  posture_ = transit_.joints().q;
  posture_goal_ = transit_.braking() ? posture_ : transit_.end();
}

// At the end of its path the hand turns into the approach without a stop, where there is room beside the
// corner: the funnel holds it back until it is on the line.
bool ReferenceServo::TurnsIntoApproach() {
  if (!transit_.active() || transit_.braking() || s_.verb + 1 >= static_cast<int>(s_.verbs().size()) ||
      !std::holds_alternative<planning::ReachVerb>(s_.verbs()[ToIndex(s_.verb + 1)]))
    return false;
  const math::Pose& X_TR = reference_.X_TR();
  if ((X_TR.p - now_.X_TG.p).norm() > kCorner || math::AngleBetween(X_TR.R, now_.X_TG.R) > kCornerTurn ||
      (transit_.end() - transit_.joints().q).cwiseAbs().maxCoeff() > kCornerTurn ||
      (X_WR().p - s_.X_WH.p).norm() > kCornerLag)
    return false;
  return FindRoom() > kCornerRoom;
}

// A lift or retreat whose last stretch is left is cut short by the transit that follows.
bool ReferenceServo::TurnsIntoTransit(double left) const {
  if (s_.recovering || s_.verb + 1 < static_cast<int>(s_.verbs().size()) || s_.step + 1 >= s_.num_steps() ||
      left > std::min(kCutOff, kCutOffShare * now_.length))
    return false;
  const ResolvedStep& next = s_.steps[s_.step + 1];
  if (next.push) return false;
  for (const planning::Verb& verb : s_.plan_step(s_.step + 1).execute) {
    if (const auto* reach = std::get_if<planning::ReachVerb>(&verb)) return !reach->until_contact;
    const auto* gripper = std::get_if<planning::GripperVerb>(&verb);
    if (gripper == nullptr || !gripper->close_on.empty()) return false;
  }
  return false;
}

}  // namespace tether::execution
