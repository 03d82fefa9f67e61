#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include <Eigen/Dense>

#include "tether/robot/model.h"
#include "tether/scene/scene.h"
#include "tether/sim/world.h"

namespace tether::sim {

inline scene::Object MakeObject(const std::string& name, geometry::Shape shape, const Eigen::Vector3d& p_WO,
                                std::optional<double> mass = {}) {
  scene::Object object;
  object.name = name;
  object.shape = std::move(shape);
  object.X_ParentObject = math::Pose(p_WO);
  object.mass = mass;
  return object;
}

inline scene::Object MakeObject(const std::string& name, const geometry::Primitive& primitive,
                                const Eigen::Vector3d& p_WO, std::optional<double> mass = {}) {
  return MakeObject(name, geometry::Shape(primitive), p_WO, mass);
}

inline scene::Object MakeTable() { return MakeObject("table", geometry::Box{{2, 1, 0.5}}, {0.5, 0, -0.25}); }

/// The compound of the Workspace Reach scene: two capsules, 2 cm thick.
inline scene::Object MakeHook(const Eigen::Vector3d& p_WO) {
  const math::Pose X_HandlePart(math::RotationFromRpy({0, M_PI / 2, 0}), Eigen::Vector3d(-0.09, 0.05, 0));
  const math::Pose X_HeadPart(math::RotationFromRpy({M_PI / 2, 0, 0}), Eigen::Vector3d(0.035, 0, 0));
  return MakeObject("hook",
                    geometry::Shape(std::vector<geometry::Part>{{geometry::Capsule{0.01, 0.25}, X_HandlePart},
                                                                {geometry::Capsule{0.01, 0.10}, X_HeadPart}}),
                    p_WO, 0.1);
}

inline std::shared_ptr<const robot::Model> Panda() {
  static const std::shared_ptr<const robot::Model> model = robot::Model::Load("panda");
  return model;
}

inline scene::Robot MakePanda() {
  scene::Robot robot;
  robot.name = "panda";
  robot.model = "panda";
  return robot;
}

/// A servo for tests: the hand is pulled to a pose by a spring and damper, mapped by the Jacobian's transpose
/// weighted with the operational-space inertia.
class TestServo {
 public:
  TestServo(World* world, std::string name)
      : world_(world), name_(std::move(name)), state_(Panda()), posture_(Panda()->home()) {
    Measure();
    X_BH_ = state_.X_BH();
  }

  const math::Pose& X_BH() { return Measure(); }
  robot::GripperCommand gripper{robot::GripperCommand::Mode::kOpening, 0.08, 0};

  void Open(double opening) { gripper = {robot::GripperCommand::Mode::kOpening, opening, 0}; }
  void Close(double force) { gripper = {robot::GripperCommand::Mode::kForce, 0, force}; }

  /// Moves the set point on a straight line to `X_BH` over `duration` seconds.
  void MoveTo(const math::Pose& X_BH, double duration) {
    const math::Pose start = X_BH_;
    const math::Pose change = math::Between(start, X_BH);
    const Eigen::Vector3d turn = math::LogSO3(change.R);
    const double begin = world_->time();
    while (world_->time() < begin + duration) {
      const double s = std::min(1.0, (world_->time() - begin) / duration);
      const double share = s * s * (3 - 2 * s);
      X_BH_ = math::Pose(start.R * math::ExpSO3(share * turn), start.p + share * (X_BH.p - start.p));
      Tick();
    }
    X_BH_ = X_BH;
  }
  void Wait(double duration) { MoveTo(X_BH_, duration); }

 private:
  const math::Pose& Measure() {
    world_->Observe(&seen_);
    state_.Set(seen_.at(name_).q, seen_.at(name_).v);
    return state_.X_BH();
  }

  void Tick() {
    Measure();
    const Eigen::MatrixXd& J = state_.J_BH();
    const Eigen::MatrixXd M_inverse = state_.M().inverse();
    const math::Vector6d velocity = J * state_.v();
    math::Vector6d acceleration;
    acceleration.head<3>() = 400 * (X_BH_.p - state_.X_BH().p) - 40 * velocity.head<3>();
    acceleration.tail<3>() = 400 * (state_.X_BH().R * math::LogSO3(state_.X_BH().R.transpose() * X_BH_.R)) -
                             40 * velocity.tail<3>();
    const math::Matrix6d inertia =
        (J * M_inverse * J.transpose() + 1e-6 * math::Matrix6d::Identity()).inverse();
    const Eigen::VectorXd posture = state_.M() * (10 * (posture_ - state_.q()) - 6 * state_.v());
    commands_[name_].torque = state_.bias() + J.transpose() * (inertia * acceleration) + posture -
                              J.transpose() * (inertia * (J * (M_inverse * posture)));
    commands_[name_].gripper = gripper;
    world_->Apply(commands_, 0.001);
  }

  World* world_;
  std::string name_;
  robot::State state_;
  Eigen::VectorXd posture_;
  math::Pose X_BH_;
  robot::Observations seen_;
  robot::Commands commands_;
};

inline const Eigen::Matrix3d& Down() {
  static const Eigen::Matrix3d R = Eigen::Vector3d(1, -1, -1).asDiagonal();
  return R;
}

}  // namespace tether::sim
