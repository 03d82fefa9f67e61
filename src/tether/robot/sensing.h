#pragma once

namespace tether::robot {

/// What is wrong with sensors, in simulation; zero: nothing.
struct Sensing {
  // Of the estimated external joint torques.
  double torque_noise = 0;  ///< Standard deviation in each tick, Nm.
  double torque_bias = 0;   ///< Of each joint, up or down, Nm.
  /// The model by which they are told has link masses that are off by this share, up or down: so much of each
  /// joint's weight is felt as if something pressed.
  double mass_error = 0;
  double torque_delay = 0;  ///< s

  // Of the poses of objects.
  double pose_noise = 0;   ///< Standard deviation along each axis, m …
  double angle_noise = 0;  ///< … and about each axis, rad.
  double pose_rate = 0;    ///< Measurements per second; 0: one in every tick.
  double pose_delay = 0;   ///< s
  double dropout = 0;      ///< The share of measurements, of each object by itself, that is missing.

  bool exact_torques() const {
    return torque_noise == 0 && torque_bias == 0 && mass_error == 0 && torque_delay == 0;
  }
  bool exact_poses() const {
    return pose_noise == 0 && angle_noise == 0 && pose_rate == 0 && pose_delay == 0 && dropout == 0;
  }
};

}  // namespace tether::robot
