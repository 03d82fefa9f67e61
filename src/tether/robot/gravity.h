#pragma once

namespace tether::robot {

/// The acceleration of gravity, along -z of the world, m/s²: of the simulation, of the robots' dynamics and
/// wherever a weight counts. The value that robot models and simulators share, not that of a place.
inline constexpr double kGravity = 9.81;

}  // namespace tether::robot
