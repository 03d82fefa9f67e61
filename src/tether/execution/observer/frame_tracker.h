#pragma once

#include "tether/math/pose.h"

namespace tether::execution {

/// Follows a frame that is measured now and then: a second-order filter (alpha–beta, critically damped) that
/// lags neither a frame at rest nor one at constant velocity, and smooths jumps. Where measurements scatter,
/// it averages over longer: its bandwidth follows from how far the innovations agree on a direction (Trigg
/// and Leach 1967, "Exponential smoothing with an adaptive response rate"). Allocates nothing.
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
  /// Where the frame is at a time after the last Predict(), s, if it goes on as it moves.
  math::Pose At(double time) const;
  /// Measurements do not scatter: the last one is better than any mean.
  bool exact() const { return position_.exact() && rotation_.exact(); }

 private:
  /// How far innovations agree.
  struct Agreement {
    void Add(const Eigen::Vector3d& innovation, double share);
    bool exact() const { return size < none; }
    /// 1: all point the same way; 0: they scatter.
    double ratio() const;
    double none;  ///< Innovations that are smaller are no noise, m or rad.
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    double size = 0;
    double weight = 1;  ///< Of the last one.
  };
  double Bandwidth(const Agreement& agreement) const;

  double bandwidth_;
  math::Pose X_WF_;
  math::Vector6d V_WF_ = math::Vector6d::Zero();
  double time_ = 0;
  double measured_ = 0;
  Agreement position_{2e-4}, rotation_{1e-3};
};

}  // namespace tether::execution
