// What the simulated robots do with their commands, and what pushes them.
#include <algorithm>
#include <cmath>

#include <mujoco/mujoco.h>

#include "tether/sim/world_impl.h"

namespace tether::sim {
namespace {

// A finger's servo to an opening: stiffness in N/m, and the force at which it saturates, which also bounds
// the fingers' speed.
constexpr double kFingerStiffness = 4000;
constexpr double kFingerServoForce = 20;
// The same for fingers on hinges, in Nm/rad.
constexpr double kFingerTurnStiffness = 4;
// The servo of an arm that follows velocities: stiffness in 1/s², critically damped, and the greatest lag,
// rad.
constexpr double kServoStiffness = 2500;
constexpr double kServoLeash = 0.05;
// An arm without a command floats; this much damping, in Nm s/rad, keeps it from drifting.
constexpr double kFloatDamping = 10;

}  // namespace

void World::Impl::ServoVelocity(RobotEntry& robot) {
  std::fill(acceleration.begin(), acceleration.end(), 0.0);
  for (size_t i = 0; i < robot.dof.size(); ++i) {
    const double q = data->qpos[robot.qpos[i]];
    double& reference = robot.reference[static_cast<Eigen::Index>(i)];
    const double velocity = robot.velocity[static_cast<Eigen::Index>(i)];
    // The reference of an arm that is blocked does not wind up.
    reference = std::clamp(reference + velocity * options.timestep, q - kServoLeash, q + kServoLeash);
    acceleration[robot.dof[i]] = kServoStiffness * (reference - q) +
                                 2 * std::sqrt(kServoStiffness) * (velocity - data->qvel[robot.dof[i]]);
  }
  mj_mulM(model.get(), data.get(), inertia_torque.data(), acceleration.data());
  for (size_t i = 0; i < robot.dof.size(); ++i) {
    const double limit = robot.model->max_torque()[static_cast<Eigen::Index>(i)];
    robot.torque[static_cast<Eigen::Index>(i)] =
        std::clamp(data->qfrc_bias[robot.dof[i]] + inertia_torque[robot.dof[i]], -limit, limit);
  }
}

void World::Impl::ApplyForces() {
  for (RobotEntry& robot : robots) {
    if (robot.commanded && robot.follows_velocity) ServoVelocity(robot);
    for (size_t i = 0; i < robot.dof.size(); ++i) {
      const int dof = robot.dof[i];
      data->qfrc_applied[dof] =
          robot.commanded ? robot.torque[i] : data->qfrc_bias[dof] - kFloatDamping * data->qvel[dof];
    }
    ApplyPush(robot);
    const robot::Gripper& gripper = robot.model->gripper();
    const size_t fingers = robot.finger_dof.size();
    const double share = std::clamp(robot.gripper.force, 0.0, gripper.max_force) / gripper.max_force;
    for (size_t i = 0; i < fingers; ++i) {
      const bool hinged = gripper.hinged();
      const double closing = hinged ? gripper.closing_torque[i] : gripper.max_force;
      const double toward_closed = hinged && gripper.closed[i] > gripper.open[i] ? 1.0 : -1.0;
      double force = toward_closed * share * closing;
      if (robot.gripper.mode == robot::GripperCommand::Mode::kOpening) {
        const double opening = std::clamp(robot.gripper.opening, 0.0, gripper.max_opening);
        const double limit = hinged ? closing : std::min(kFingerServoForce, closing);
        const double stiffness = hinged ? kFingerTurnStiffness : kFingerStiffness;
        force = std::clamp(
            stiffness * (gripper.FingerPosition(i, fingers, opening) - data->qpos[robot.finger_qpos[i]]),
            -limit, limit);
      }
      data->qfrc_applied[robot.finger_dof[i]] = force;
    }
  }
}

}  // namespace tether::sim
