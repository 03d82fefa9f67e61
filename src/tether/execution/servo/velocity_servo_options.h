#pragma once

#include <vector>

#include "tether/common/error.h"
#include "tether/control/constrained_velocity.h"
#include "tether/control/constraint_spec.h"
#include "tether/control/torque/constrained_torque.h"

namespace tether::execution {

struct VelocityServoOptions {
  control::VelocityOptions controller;
  std::vector<control::ConstraintSpec> constraints;  ///< Those of the scenario.
  double acceleration = 0.5;  ///< How fast a verb's speed rises, m/s²; turning in rad/s².
  double turn_speed = 0.6;    ///< Of the hand, rad/s.
  double foot_gap = 0.0015;   ///< Held objects are released this high above a region, m.
  /// The arm is driven by torques, with these settings, in place of velocities; the period is the
  /// sequencer's.
  bool torques = false;
  control::TorqueOptions torque;
  double max_force = 40;  ///< That the arm presses with then, N; a step may have its own.

  /// Reports every field that is not finite or not positive; throws InputError for the controller's.
  void Check(Diagnostics* diagnostics) const;
};

}  // namespace tether::execution
