#pragma once

#include "tether/math/pose.h"

namespace tether::execution {

/// Bounds of a reference's motion.
struct MotionLimits {
  double speed = 0.25;              ///< m/s
  double acceleration = 1.0;        ///< m/s²
  double angular_speed = 1.2;       ///< rad/s
  double angular_acceleration = 5;  ///< rad/s²
  double settle_rate = 12;          ///< The last stretch is an exponential approach with this rate, 1/s.
};

/// A pose that moves towards a goal with bounded speed and acceleration, and stops there: what the hand is
/// servoed to. It lives in the frame T of its target, so that the target's own motion passes through without
/// lag.
class PoseReference {
 public:
  /// Puts the reference at a pose with a velocity (of its origin, and angular), both in T.
  void Reset(const math::Pose& X_TR, const math::Vector6d& V_TR = math::Vector6d::Zero(),
             const math::Vector6d& A_TR = math::Vector6d::Zero());
  /// Moves towards X_TG for dt seconds. The goal may move between calls.
  void Advance(const math::Pose& X_TG, const MotionLimits& limits, double dt);

  const math::Pose& X_TR() const { return X_TR_; }
  const math::Vector6d& V_TR() const { return V_TR_; }
  const math::Vector6d& A_TR() const { return A_TR_; }

 private:
  math::Pose X_TR_;
  math::Vector6d V_TR_ = math::Vector6d::Zero();
  math::Vector6d A_TR_ = math::Vector6d::Zero();
};

}  // namespace tether::execution
