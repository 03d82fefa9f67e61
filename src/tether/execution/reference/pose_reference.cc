#include "tether/execution/reference/pose_reference.h"

#include <algorithm>
#include <cmath>

#include "tether/math/pose_error.h"

namespace tether::execution {
namespace {

// The velocity to have `error` away from the goal. It brakes with half of the acceleration, so that the other
// half is left for turning towards a goal that moves.
Eigen::Vector3d DesiredVelocity(const Eigen::Vector3d& error, double max_speed, double max_acceleration,
                                double settle_rate) {
  const double distance = error.norm();
  if (distance < 1e-12) return Eigen::Vector3d::Zero();
  const double speed = std::min({max_speed, std::sqrt(max_acceleration * distance), settle_rate * distance});
  return error * (speed / distance);
}

Eigen::Vector3d Limited(const Eigen::Vector3d& v, double max) {
  const double norm = v.norm();
  return norm > max ? Eigen::Vector3d(v * (max / norm)) : v;
}

}  // namespace

void PoseReference::Reset(const math::Pose& X_TR, const math::Vector6d& V_TR, const math::Vector6d& A_TR) {
  X_TR_ = X_TR;
  V_TR_ = V_TR;
  A_TR_ = A_TR;
}

void PoseReference::Advance(const math::Pose& X_TG, const MotionLimits& limits, double dt) {
  const math::Vector6d left = math::PoseError(X_TR_, X_TG);
  const Eigen::Vector3d v =
      DesiredVelocity(left.head<3>(), limits.speed, limits.acceleration, limits.settle_rate);
  const Eigen::Vector3d w =
      DesiredVelocity(left.tail<3>(), limits.angular_speed, limits.angular_acceleration, limits.settle_rate);
  A_TR_.head<3>() = Limited((v - V_TR_.head<3>()) / dt, limits.acceleration);
  A_TR_.tail<3>() = Limited((w - V_TR_.tail<3>()) / dt, limits.angular_acceleration);
  V_TR_ += dt * A_TR_;
  X_TR_.p += dt * V_TR_.head<3>();
  X_TR_.R = math::ProjectToSO3(math::ExpSO3(dt * V_TR_.tail<3>()) * X_TR_.R);
}

}  // namespace tether::execution
