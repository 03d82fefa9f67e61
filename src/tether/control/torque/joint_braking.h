#pragma once

#include <Eigen/Core>

#include "tether/robot/model.h"

namespace tether::control {

/// What a joint can do against its motion from now on.
struct Braking {
  double deceleration = 1;  ///< rad/s²
  double jerk = 100;        ///< With which the deceleration builds up, rad/s³.
};

/// How far a joint still runs, rad, that moves at `v` (rad/s) and accelerates at `a` (rad/s²), if from now on
/// its acceleration falls with `braking.jerk` to −`braking.deceleration` until it stands. Zero if it does not
/// move forward; `a` ≥ −deceleration counts.
double StoppingDistance(double v, double a, const Braking& braking);

/// The greatest acceleration, at most `most`, for the next `period` (s), after which the joint still stops
/// within `room` (rad, from where it is now). Less than −braking.deceleration, down to −`hardest`, where it
/// is too late or the joint is beyond its limit: then it comes back, no faster than `return_speed` (rad/s).
double MostAccelerationToStop(double room, double v, double most, double hardest, double return_speed,
                              double period, const Braking& braking);

/// The greatest acceleration for the next `period` after which the speed still stays below `v` + `room` with
/// `braking.jerk`; negative where the speed is beyond it, down to −`hardest`.
double MostAccelerationToKeepSpeed(double room, double hardest, double period, const Braking& braking);

/// Decelerations and jerks that all joints have at once, whatever the signs: with accelerations within
/// ± deceleration, |M q̈ + h| stays within the torques, and with jerks within ± jerk |M q⃛| within the torque
/// rates. `share` is what of each is counted on. The rest is for what M and h do meanwhile.
class BrakingReserve {
 public:
  explicit BrakingReserve(const robot::Model& model);
  /// `bias`: the torques that hold the arm (h, and what it carries), n, Nm.
  void Set(const Eigen::MatrixXd& M, const Eigen::VectorXd& bias, double torque_share, double rate_share);
  Braking of(int joint) const {
    return {deceleration_scale_ * acceleration_[joint], jerk_scale_ * jerk_[joint]};
  }

 private:
  Eigen::VectorXd acceleration_, jerk_, max_torque_, max_rate_;
  double deceleration_scale_ = 1, jerk_scale_ = 1;
};

}  // namespace tether::control
