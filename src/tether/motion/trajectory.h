#pragma once

#include <vector>

#include <Eigen/Core>

#include "tether/robot/model.h"

namespace tether::motion {

/// What a trajectory of the joints keeps to. All n.
struct JointLimits {
  Eigen::VectorXd velocity;      ///< rad/s
  Eigen::VectorXd acceleration;  ///< rad/s²
  Eigen::VectorXd jerk;          ///< rad/s³
};

/// A robot's limits, less what a controller needs to follow: so much of velocity, acceleration and jerk.
JointLimits LimitsOf(const robot::Model& model, double velocity_share = 0.75, double acceleration_share = 0.6,
                     double jerk_share = 0.6);

/// Where the joints shall be at an instant. All n: rad, rad/s, rad/s².
struct JointReference {
  Eigen::VectorXd q, v, a;
};

/// A motion of the joints in time, from rest to rest: samples at equal distances, with cubic pieces between
/// them, so that velocities are continuous and accelerations are those of the samples.
class Trajectory {
 public:
  Trajectory() = default;
  /// Samples of positions, n × N, N ≥ 2, `period` apart, s.
  Trajectory(Eigen::MatrixXd q, double period);

  bool empty() const { return q_.cols() == 0; }
  double duration() const { return empty() ? 0 : period_ * static_cast<double>(q_.cols() - 1); }  ///< s
  double period() const { return period_; }
  const Eigen::MatrixXd& samples() const { return q_; }
  /// At a time, s; before 0 and after the end it rests. Allocates nothing if `at` has the right sizes.
  void Evaluate(double time, JointReference* at) const;
  /// The same motion, `factor` times as long.
  void Stretch(double factor) { period_ *= factor; }
  /// The greatest share of the limits that is used, by velocities, accelerations and jerks, each as what it
  /// would have to be stretched by.
  double StretchFor(const JointLimits& limits) const;

 private:
  Eigen::MatrixXd q_;  ///< n × N
  double period_ = 0;
};

/// How corners of a path are passed.
enum class Corners {
  kRounded,  ///< Cut a little, at a speed that the limits allow.
  kStop,     ///< The arm stops there: the trajectory stays on the path exactly.
};

/// Times a path (n each, straight in between, at least one configuration): as fast as possible within
/// `limits` along each piece, then smoothed twice by a moving average, which bounds acceleration and jerk,
/// and stretched so that none of the limits is exceeded.
Trajectory TimePath(const std::vector<Eigen::VectorXd>& path, const JointLimits& limits,
                    Corners corners = Corners::kRounded);

/// What a trajectory must not ask for, beyond the limits of the joints.
struct LoadLimits {
  double torque_share = 0.8;  ///< Of each joint's greatest torque; the rest is the controller's.
  double payload = 0;         ///< What is held weighs so much, kg …
  Eigen::Vector3d p_HC = Eigen::Vector3d::Zero();  ///< … and has its centre of mass there, in the hand, m.
  double hand_acceleration = 8;                    ///< m/s²
  double hand_speed = 1.5;                         ///< m/s
};

/// Stretches the trajectory until torques (by the model's dynamics, with the payload as a point) and the
/// hand's speed and acceleration are within what is allowed. `state` is a workspace; its gravity counts.
void StretchForLoad(const LoadLimits& limits, robot::State& state, Trajectory* trajectory);

}  // namespace tether::motion
