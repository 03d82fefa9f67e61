#include <algorithm>
#include <cmath>

#include "tether/execution/servo/reference_servo.h"
#include "tether/geometry/distance/distance.h"
#include "tether/robot/gravity.h"

namespace tether::execution {
namespace {

// The null-space posture moves towards its goal at most this fast, rad/s.
constexpr double kPostureSpeed = 0.8;
// The payload's weight is fed forward fully after this time from grasping, s.
constexpr double kTakeOver = 0.3;
// Obstacles are looked for every so many ticks.
constexpr int kObstacleTicks = 4;
// Objects whose parts are all further than this from the grasp point are not looked at, m.
constexpr double kFar = 0.3;
// A hand this many leashes behind is no longer pulled to its reference; the reference starts over from the
// hand.
constexpr double kLostHand = 3;
// In a transit around obstacles the wrist stays this far within the arm's reach, m.
constexpr double kWithinReach = 0.04;

}  // namespace

// The reference keeps its pose and velocity in the world, but now goes along with another frame.
void ReferenceServo::SwitchFrame(const AttachedFrame& frame) {
  const auto velocity_at = [this](const AttachedFrame& f, const math::Pose& X_WFrame,
                                  const Eigen::Vector3d& p_W) {
    math::Vector6d V = V_WF(f);
    V.head<3>() += V.tail<3>().cross(p_W - X_WFrame.p);
    return V;
  };
  const math::Pose X_WOld = X_WF(frame_);
  const math::Pose X_WNew = X_WF(frame);
  const math::Pose X_WRef = X_WOld * reference_.X_TR();
  math::Vector6d V = velocity_at(frame_, X_WOld, X_WRef.p) - velocity_at(frame, X_WNew, X_WRef.p);
  V.head<3>() += X_WOld.R * reference_.V_TR().head<3>();
  V.tail<3>() += X_WOld.R * reference_.V_TR().tail<3>();
  V.head<3>() = (X_WNew.R.transpose() * V.head<3>()).eval();
  V.tail<3>() = (X_WNew.R.transpose() * V.tail<3>()).eval();
  frame_ = frame;
  reference_.Reset(math::Between(X_WNew, X_WRef), V);
  now_.X_TG = reference_.X_TR();
}

void ReferenceServo::ResetReferenceToHand() {
  reference_.Reset(math::Between(X_WF(frame_), s_.X_WH));
  now_.X_TG = reference_.X_TR();
}

void ReferenceServo::MoveReference() {
  MotionLimits limits = options_.motion;
  LimitMotion(&limits);
  math::Pose X_WRef = X_WR();
  double lag = (X_WRef.p - s_.X_WH.p).norm();
  if (lag > kLostHand * options_.leash) {
    // The target jumped: the hand follows at its own speed, from where it is.
    const VerbState now = now_;
    ResetReferenceToHand();
    now_ = now;
    X_WRef = s_.X_WH;
    lag = 0;
  }
  const double turn_lag = math::AngleBetween(X_WRef.R, s_.X_WH.R);
  const double slack =
      std::clamp(2 - std::max(lag / options_.leash, turn_lag / (10 * options_.leash)), 0.0, 1.0);
  limits.speed *= slack;
  limits.angular_speed *= slack;

  if (transit_.active()) return FollowTransit(slack);
  math::Pose X_TWaypoint = now_.X_TG;
  if (now_.transit) {
    const math::Pose X_WT = X_WF(frame_);
    const math::Pose X_WG = X_WT * now_.X_TG;
    body_bounds_.clear();
    obstacle_bounds_.clear();
    const auto add_body = [&](const geometry::Shape& shape, const math::Pose& X_HS) {
      for (const auto& part : shape.parts) {
        const math::Pose X_HP = X_HS * part.X_SP;
        geometry::Aabb& box = body_bounds_.emplace_back();
        for (const Eigen::Matrix3d& R : {X_WRef.R, X_WG.R})
          box.Include(geometry::BoundingBox(part.primitive, math::Pose(R, Eigen::Vector3d::Zero()) * X_HP));
      }
    };
    add_body(hand_shape_, math::Pose());
    for (const ObjectId i : s_.objects.ids()) {
      const geometry::Shape& shape = s_.object(i).shape;
      if (MovesWithHand(i)) {
        add_body(shape, math::Between(s_.X_WH, s_.objects[i].X));
        continue;
      }
      for (const auto& part : shape.parts) {
        obstacle_bounds_.push_back(geometry::BoundingBox(part.primitive, s_.objects[i].X * part.X_SP));
      }
    }
    const double ceiling = s_.X_WB.p.z() + s_.model->reach().centre.z() + 0.5 * s_.model->reach().max;
    const Passage passage =
        CheckPassage(body_bounds_, X_WRef.p, X_WG.p, obstacle_bounds_, options_.transit, ceiling);
    if (passage.blocked) {
      const robot::Reach& reach = s_.model->reach();
      const Eigen::Vector3d p_WCentre = s_.X_WB * reach.centre;
      const double radius = std::max(reach.max - kWithinReach, (X_WG * reach.wrist_hand - p_WCentre).norm());
      X_TWaypoint = math::Between(
          X_WT, DrawWithin(TransitWaypoint(passage, X_WRef, X_WG), reach.wrist_hand, p_WCentre, radius));
    }
  }
  if (now_.funnel_length > 0) {
    const math::Pose X_TH = math::Between(X_WF(frame_), s_.X_WH);
    X_TWaypoint = FunnelWaypoint(now_.X_TG, now_.funnel_T, now_.funnel_length, reference_.X_TR(), X_TH);
  }
  reference_.Advance(X_TWaypoint, limits, shared_.period);
}

void ReferenceServo::AimPosture() {
  if (transit_.active()) return;
  if (!posture_search_.done()) {
    posture_search_.Advance();
    if (posture_search_.done())
      posture_goal_ = posture_search_.reached() ? posture_search_.q() : s_.model->home();
  }
  const double most = kPostureSpeed * shared_.period;
  posture_ += (posture_goal_ - posture_).cwiseMax(-most).cwiseMin(most);
  controller_.set_posture(posture_);
}

void ReferenceServo::AvoidObstacles(control::HandTarget* target) {
  if (tick_ % kObstacleTicks == 0) {
    obstacle_weight_ = 0;
    const bool known = s_.in_plan();
    double nearest = options_.obstacle_range;
    for (const ObjectId object : s_.objects.ids()) {
      // Contact that the step intends.
      if (MovesWithHand(object)) continue;
      if (known && (object == s_.current().control || object == s_.current().target.object ||
                    object == s_.current().tool))
        continue;
      bool far = true;
      for (const auto& part : s_.object(object).shape.parts) {
        const geometry::Aabb bounds = geometry::BoundingBox(part.primitive, s_.X_WO(object) * part.X_SP);
        const Eigen::Vector3d outside =
            (bounds.lower - s_.X_WH.p).cwiseMax(s_.X_WH.p - bounds.upper).cwiseMax(0.0);
        far = far && outside.norm() > kFar;
      }
      if (far) continue;
      const geometry::Distance distance =
          geometry::SignedDistance(hand_shape_, s_.X_WH, s_.object(object).shape, s_.X_WO(object));
      if (distance.distance >= nearest) continue;
      nearest = distance.distance;
      obstacle_direction_B_ = s_.X_WB.R.transpose() * distance.n_W;
      obstacle_weight_ = std::clamp(1 - nearest / options_.obstacle_range, 0.0, 1.0);
    }
  }
  target->toward_obstacle.setZero();
  if (obstacle_weight_ > 0) target->toward_obstacle = obstacle_direction_B_;
  target->obstacle_weight = obstacle_weight_;
}

control::HandTarget ReferenceServo::RestingTarget() {
  constexpr double kAtRest = 0.02;  // rad/s
  if (!resting_ && s_.v.cwiseAbs().maxCoeff() < kAtRest) resting_ = state_.X_BH();
  control::HandTarget target;
  target.X_BH = resting_.value_or(state_.X_BH());
  return target;
}

control::HandTarget ReferenceServo::TargetNow() const {
  control::HandTarget target;
  const math::Pose X_WT = X_WF(frame_);
  const math::Vector6d V_WT = V_WF(frame_);
  const math::Pose X_WRef = X_WT * reference_.X_TR();
  target.X_BH = math::Between(s_.X_WB, X_WRef);
  const Eigen::Matrix3d R_BW = s_.X_WB.R.transpose();
  const Eigen::Matrix3d R_BT = R_BW * X_WT.R;
  target.V_BH.head<3>() =
      R_BW * (V_WT.head<3>() + V_WT.tail<3>().cross(X_WRef.p - X_WT.p)) + R_BT * reference_.V_TR().head<3>();
  target.V_BH.tail<3>() = R_BW * V_WT.tail<3>() + R_BT * reference_.V_TR().tail<3>();
  target.A_BH.head<3>() = R_BT * reference_.A_TR().head<3>();
  target.A_BH.tail<3>() = R_BT * reference_.A_TR().tail<3>();
  return target;
}

void ReferenceServo::CommandTorque(robot::Command* command) {
  control::HandTarget target = s_.stopping && s_.trustworthy ? RestingTarget() : TargetNow();
  if (servo_) {
    target.F_BH = servo_->Holding(state_.X_BH());
  } else if (s_.held != kNone) {
    const scene::Object& object = s_.object(s_.held);
    const double share = std::clamp((s_.time - s_.held_since) / kTakeOver, 0.0, 1.0);
    const Eigen::Vector3d lift(0, 0, share * object.mass.value_or(0) * robot::kGravity);
    const Eigen::Vector3d arm = X_WO(s_.held) * geometry::CentreOfMass(object.shape) - s_.X_WH.p;
    target.F_BH.head<3>() = s_.X_WB.R.transpose() * lift;
    target.F_BH.tail<3>() = s_.X_WB.R.transpose() * arm.cross(lift);
  }
  FindAllowed();
  if (servo_) return CommandConstrained(target, command);
  if (s_.trustworthy) AvoidObstacles(&target);
  const control::JointTarget joints{transit_.joints().q, transit_.joints().v, transit_.joints().a};
  const bool follows = transit_.active() && !s_.stopping;
  if (follows) target.obstacle_weight = 0;  // The path is free.
  carried_torque_.noalias() = state_.J_BH().transpose() * target.F_BH;
  command->torque = limiter_->Limit(state_, controller_.Compute(state_, target, follows ? &joints : nullptr),
                                    &carried_torque_);
  WatchController();
}

void ReferenceServo::WatchController() {
  const control::ControlFlags& flags = controller_.flags();
  if (flags.fault && !fault_reported_) {
    s_.Record(EventKind::kSafety, "the robot's state is not finite; the arm is braked");
  }
  if ((flags.joint_limit || limiter_->flags().motion) && !limit_reported_)
    s_.Record(EventKind::kSafety, "a joint is braked before its limit");
  fault_reported_ = flags.fault;
  limit_reported_ = limit_reported_ || flags.joint_limit || limiter_->flags().motion;
}

}  // namespace tether::execution
