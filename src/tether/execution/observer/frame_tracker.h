#pragma once

#include "tether/math/pose.h"

namespace tether::execution {

/// Follows a frame that is measured now and then: a second-order filter (alpha–beta, critically damped) that
/// lags neither a frame at rest nor one at constant velocity, and smooths jumps. Allocates nothing.
class FrameTracker {
 public:
  /// `bandwidth` in 1/s: how fast jumps are followed.
  explicit FrameTracker(double bandwidth = 60) : bandwidth_(bandwidth) {}

  /// Puts the frame at a pose, at rest.
  void Reset(const math::Pose& X_WF, double time);
  /// Predicts up to `time` (s, not decreasing).
  void Predict(double time);
  /// Corrects the prediction with a measurement made at the time of the last Predict().
  void Correct(const math::Pose& X_WF);

  const math::Pose& X_WF() const { return X_WF_; }
  /// Velocity of the frame's origin, and angular velocity, in the world: m/s, rad/s.
  const math::Vector6d& V_WF() const { return V_WF_; }

 private:
  double bandwidth_;
  math::Pose X_WF_;
  math::Vector6d V_WF_ = math::Vector6d::Zero();
  double time_ = 0;
  double measured_ = 0;
};

}  // namespace tether::execution
