#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

#include "tether/control/constrained_velocity.h"
#include "tether/geometry/distance/distance.h"
#include "tether/robot/kinematics.h"
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
  /// What was exceeded so far: "velocity by 0.1", or nothing.
  std::string Exceeded(bool acceleration = true) const {
    std::string text;
    const auto look = [&text](const char* name, double room) {
      if (room < 0) text += std::string(name) + " by " + std::to_string(-room) + " ";
    };
    look("torque", torque_room);
    look("torque rate", rate_room);
    look("velocity", velocity_room);
    look("position", position_room);
    // To what the integration leaves of it.
    if (acceleration) look("acceleration", acceleration_room + 0.05);
    return text;
  }
  Eigen::Matrix<double, 6, 1> HandVelocity() const { return state.J_BH() * v; }

  std::shared_ptr<const robot::Model> model;
  robot::State state;
  Eigen::VectorXd q, v, last;
  double torque_room = 1e300, rate_room = 1e300, velocity_room = 1e300, position_room = 1e300,
         acceleration_room = 1e300;
};

/// Links, hand and held object keep clear of these objects.
inline ClearanceConstraint KeepClear(const robot::Model& model, std::vector<int> to, double distance = 0.01,
                                     Priority priority = 0) {
  ClearanceConstraint clearance{"clearance", {}, true, std::move(to), distance, priority};
  for (int body = 0; body <= model.solids().hand(); ++body) clearance.of.push_back(body);
  return clearance;
}

/// The least distance of the arm's bodies from an object, m, without a controller's rows.
inline double LeastDistance(const ArmBodies& bodies, int object) {
  double least = 1e9;
  const int b = bodies.object(object);
  for (int a = 0; a <= bodies.hand(); ++a) {
    if (bodies.link(a) == 0) continue;
    for (const auto* p = bodies.begin(a); p != bodies.end(a); ++p) {
      for (const auto* r = bodies.begin(b); r != bodies.end(b); ++r) {
        least =
            std::min(least, geometry::SignedDistance(p->primitive, p->X_BP, r->primitive, r->X_BP).distance);
      }
    }
  }
  return least;
}

}  // namespace tether::control
