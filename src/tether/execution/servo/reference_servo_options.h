#pragma once

#include "tether/common/error.h"
#include "tether/control/operational_space.h"
#include "tether/execution/observer/contact_detector.h"
#include "tether/execution/reference/arm_transit_options.h"
#include "tether/execution/reference/pose_reference.h"
#include "tether/execution/reference/transit.h"
#include "tether/execution/servo/torque_servo.h"

namespace tether::execution {

struct ReferenceServoOptions {
  control::OperationalSpaceGains gains;
  MotionLimits motion;             ///< Speeds are the lesser of these and the verb's.
  double free_speed = 0.6;         ///< Of straight motions away from anything, m/s …
  double free_acceleration = 4.0;  ///< … and m/s².
  TransitMargins transit;
  ContactDetector::Options contact;
  double contact_search = 0.01;   ///< A reach until contact goes on so far beyond its pose, m.
  double leash = 0.02;            ///< The reference waits for a hand that is further behind, m.
  double obstacle_range = 0.05;   ///< Obstacle damping begins at this distance, m.
  double push_tolerance = 0.003;  ///< A push ends when the object is this near to its pose, m …
  double push_angle = 0.0175;     ///< … and turned from it by no more, rad.
  double push_limit = 0.03;       ///< A push that gets no nearer still succeeds this near to its pose, m.
  ArmTransitOptions arm;          ///< Of the whole arm's motions between key poses.
  /// The constrained torque controller in place of the operational-space one.
  bool constrained = false;
  TorqueServoOptions servo;  ///< Its settings; the gains and the period are those above.

  /// Reports every field that is not finite or not positive; throws InputError for the gains.
  void Check(Diagnostics* diagnostics) const;
};

}  // namespace tether::execution
