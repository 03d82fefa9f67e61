#pragma once

#include <map>
#include <optional>
#include <string>

#include <Eigen/Core>

namespace tether::robot {

/// A gripper's command: a finger opening to servo to, or a force to close with.
struct GripperCommand {
  enum class Mode { kOpening, kForce };
  Mode mode = Mode::kOpening;
  double opening = 0;  ///< Distance between the finger pads, m; with kOpening.
  double force = 0;    ///< Closing force at each pad, N; with kForce.
};

/// An arm's command for one control period: torques, or velocities that the robot's own servo follows.
struct Command {
  enum class Mode { kTorque, kVelocity };
  Mode mode = Mode::kTorque;
  Eigen::VectorXd torque;    ///< n, Nm; with kTorque. The whole torque: the controller compensates gravity.
  Eigen::VectorXd velocity;  ///< n, rad/s; with kVelocity. The robot compensates gravity itself.
  GripperCommand gripper;
};

/// Measurements of one arm's own sensors.
struct Observation {
  double time = 0;               ///< s
  Eigen::VectorXd q;             ///< n, rad
  Eigen::VectorXd v;             ///< n, rad/s
  Eigen::VectorXd tau_external;  ///< n, Nm: estimated joint torques due to contact (payload included)
  double gripper_opening = 0;    ///< Distance between the finger pads, m
};

using Commands = std::map<std::string, Command>;          ///< By robot name.
using Observations = std::map<std::string, Observation>;  ///< By robot name.

/// A set of robots that can be commanded at a fixed rate: the simulation, or hardware.
class Interface {
 public:
  virtual ~Interface() = default;
  /// The latest measurements of every robot.
  virtual Observations Observe() const = 0;
  /// Holds the commands for one control period of `period` seconds, and returns when it has passed.
  virtual void Apply(const Commands& commands, double period) = 0;
};

}  // namespace tether::robot
