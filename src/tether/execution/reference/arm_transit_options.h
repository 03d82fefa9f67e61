#pragma once

#include <cstdint>

namespace tether::execution {

struct ArmTransitOptions {
  double clearance = 0.01;           ///< That paths keep from everything where there is room, m.
  int64_t max_checks = 600'000;      ///< Of configurations, per motion that is searched.
  double velocity_share = 0.85;      ///< Of the joints' greatest velocities …
  double acceleration_share = 0.75;  ///< … accelerations …
  double jerk_share = 0.6;           ///< … and jerks.
  double hand_speed = 1.2;           ///< m/s
  double hand_acceleration = 8;      ///< m/s² …
  double held_acceleration = 5;      ///< … and with something in the hand.
  double look_ahead_period = 0.02;   ///< The path ahead is checked so often, s.
};

}  // namespace tether::execution
