#pragma once

#include <algorithm>
#include <memory>
#include <string>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tether/robot/model.h"

namespace tether::control {

/// An arm alone, integrated semi-implicitly from its own equations of motion, that notes what its limits had
/// left.
struct TorqueArm {
  explicit TorqueArm(const std::string& name = "panda")
      : model(robot::Model::Load(name)),
        state(model),
        q(model->home()),
        v(Eigen::VectorXd::Zero(model->dof())) {
    state.Set(q, v);
    last = state.bias();
  }

  void Put(const Eigen::VectorXd& position, const Eigen::VectorXd& velocity) {
    q = position;
    v = velocity;
    state.Set(q, v);
    last = state.bias();
  }
  void Step(const Eigen::VectorXd& torque, double dt = 0.001) {
    Step(torque, Eigen::VectorXd::Zero(model->dof()), dt);
  }
  void Step(const Eigen::VectorXd& torque, const Eigen::VectorXd& external, double dt = 0.001) {
    const auto least = [](double& value, double now) { value = std::min(value, now); };
    least(torque_room, (model->max_torque() - torque.cwiseAbs()).minCoeff());
    least(rate_room, (model->max_torque_rate() - (torque - last).cwiseAbs() / dt).minCoeff());
    last = torque;
    const Eigen::VectorXd a = state.M().llt().solve(torque + external - state.bias());
    v += dt * a;
    q += dt * v;
    state.Set(q, v);
    least(position_room, std::min((q - model->lower()).minCoeff(), (model->upper() - q).minCoeff()));
    least(velocity_room, (model->max_velocity() - v.cwiseAbs()).minCoeff());
    least(acceleration_room, (model->max_acceleration() - a.cwiseAbs()).minCoeff());
  }
  void ExpectWithinLimits(bool acceleration = true) const {
    EXPECT_GE(torque_room, 0);
    EXPECT_GE(rate_room, 0);
    EXPECT_GE(velocity_room, 0);
    EXPECT_GE(position_room, 0);
    if (acceleration) {
      EXPECT_GE(acceleration_room, -0.05);
    }
  }
  Eigen::Matrix<double, 6, 1> HandVelocity() const { return state.J_BH() * v; }

  std::shared_ptr<const robot::Model> model;
  robot::State state;
  Eigen::VectorXd q, v, last;
  double torque_room = 1e300, rate_room = 1e300, velocity_room = 1e300, position_room = 1e300,
         acceleration_room = 1e300;
};

}  // namespace tether::control
