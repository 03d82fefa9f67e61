// An arm that is pushed: what is felt in the external torques counts where limits of joints are near.

#include <cmath>

#include <gtest/gtest.h>

#include "testing/control/torque_arm.h"
#include "tether/control/torque/constrained_torque.h"
#include "tether/control/torque/torque_limiter.h"

namespace tether::control {
namespace {

using Eigen::VectorXd;

struct Swing {
  double fastest = 0;    ///< Share of the greatest speed.
  double beyond = -1e9;  ///< Of a position limit, rad.
  double rate = 0;       ///< Share of the torque rate.
};

/// 0.3 s of torques, which rise and fall within 50 ms, on an arm that holds its pose.
Swing Push(const VectorXd& q, const VectorXd& push) {
  const auto model = robot::Model::Load("panda");
  robot::State state(model);
  ConstrainedTorque controller(model, {}, {}, {}, {}, {});
  TorqueLimiter limiter(model, {});
  VectorXd now = q, v = VectorXd::Zero(7), last;
  state.Set(now, v);
  HandTarget target;
  target.X_BH = state.X_BH();
  Swing swing;
  for (int tick = 0; tick < 900; ++tick) {
    const double t = 0.001 * (tick - 100);
    const double share = t < 0 || t > 0.3 ? 0 : std::min({1.0, t / 0.05, (0.3 - t) / 0.05});
    const VectorXd external = share * push;
    state.Set(now, v);
    const VectorXd& wanted = controller.Compute({state, 0.04, {}, &external}, {&target, nullptr, &q});
    const VectorXd torque = limiter.Limit(state, wanted, nullptr, &controller.felt());
    controller.SetLast(torque);
    if (last.size() == 7)
      swing.rate = std::max(
          swing.rate,
          ((torque - last).cwiseAbs().array() / 0.001 / model->max_torque_rate().array()).maxCoeff());
    last = torque;
    v += 0.001 * state.M().llt().solve(torque + external - state.bias());
    now += 0.001 * v;
    swing.fastest =
        std::max(swing.fastest, (v.cwiseAbs().array() / model->max_velocity().array()).maxCoeff());
    swing.beyond =
        std::max({swing.beyond, (now - model->upper()).maxCoeff(), (model->lower() - now).maxCoeff()});
  }
  return swing;
}

TEST(PushedArm, NoJointIsPushedBeyondATenthOfItsSpeed) {
  const auto model = robot::Model::Load("panda");
  for (int joint = 0; joint < 7; ++joint) {
    for (const double sign : {1.0, -1.0}) {
      VectorXd push = VectorXd::Zero(7);
      push[joint] = sign * (joint < 4 ? 20 : 5);
      const Swing swing = Push(model->home(), push);
      EXPECT_LE(swing.fastest, 1.1) << "joint " << joint + 1;
      EXPECT_LE(swing.beyond, 0) << "joint " << joint + 1;
      EXPECT_LE(swing.rate, 1 + 1e-9) << "joint " << joint + 1;
    }
  }
}

TEST(PushedArm, NoJointIsPushedBeyondItsLimit) {
  const auto model = robot::Model::Load("panda");
  for (int joint = 0; joint < 7; ++joint) {
    VectorXd q = model->home(), push = VectorXd::Zero(7);
    q[joint] = model->upper()[joint] - 0.06;
    push[joint] = joint < 4 ? 20 : 5;
    EXPECT_LE(Push(q, push).beyond, 0) << "joint " << joint + 1;
  }
}

/// The least distance of an arm that is pushed from a table beneath it, m. `down`: the hand is led towards it
/// meanwhile, m/s.
double PushAbove(double gap, double down, const VectorXd& q, const VectorXd& push) {
  TorqueArm arm;
  arm.Put(q, VectorXd::Zero(7));
  const std::vector<Solid> table{
      {"table", geometry::Shape(geometry::Primitive(geometry::Box{{3, 3, 0.1}})), false}};
  std::vector<MovingPose> poses(1);
  ArmBodies bodies(arm.model, table);
  robot::Kinematics kinematics(arm.model);
  const auto distance = [&] {
    kinematics.Set(arm.q);
    bodies.PlaceArm(kinematics, 0.04);
    bodies.Place(0, poses[0]);
    return LeastDistance(bodies, 0);
  };
  // In front of the base.
  poses[0].X.p = {1.7, 0, arm.state.X_BH().p.z() - 0.2};
  poses[0].X.p.z() += distance() - gap;
  ConstrainedTorque controller(arm.model, {}, table, {KeepClear(*arm.model, {0}, 0)}, {}, {});
  TorqueLimiter limiter(arm.model, {});
  HandTarget target;
  target.X_BH = arm.state.X_BH();
  double least = 1e9;
  for (int tick = 0; tick < 1400; ++tick) {
    const double t = 0.001 * (tick - 600);
    const double share = t < 0 || t > 0.3 ? 0 : std::min({1.0, t / 0.05, (0.3 - t) / 0.05});
    const VectorXd external = share * push;
    // The reference waits for the hand.
    if (down > 0 && tick > 300 && arm.state.X_BH().p.z() - target.X_BH.p.z() < 0.02)
      target.X_BH.p.z() -= 0.001 * down;
    const VectorXd& wanted = controller.Compute({arm.state, 0.04, poses, &external}, {&target, nullptr, &q});
    const VectorXd torque = limiter.Limit(arm.state, wanted, nullptr, &controller.felt());
    controller.SetLast(torque);
    arm.Step(torque, external);
    least = std::min(least, distance());
  }
  EXPECT_GT(arm.rate_room, -1e-6);
  arm.rate_room = 0;
  EXPECT_EQ(arm.Exceeded(false), "");
  return least;
}

// Pushed 2 to 4 cm above a table, the hand hit it: bounds of joints were asked to hold against the push and
// not to, at once.
TEST(PushedArm, TheHandDoesNotReachTheTableBeneathIt) {
  VectorXd q(7), push(7);
  q << 0.3, 0.4, 0.1, -2.0, 0.1, 2.4, 0.8;
  for (const double sign : {1.0, -1.0}) {
    for (const double down : {0.0, 0.15}) {
      push << 17, 5, -18, -10, 0, 0, 0;
      EXPECT_GT(PushAbove(0.03, down, q, sign * push), 0) << down;
      push << 4, 3, -16, -2, 0, 0, 0;
      EXPECT_GT(PushAbove(0.02, down, q, sign * push), 0) << down;
      push << 20, 20, 20, 20, 0, 0, 0;
      EXPECT_GT(PushAbove(0.04, down, q, sign * push), 0) << down;
    }
  }
}

// The same for pushes on the wrist.
TEST(PushedArm, APushedWristDoesNotReachTheTableBeneathIt) {
  VectorXd q(7), push(7);
  q << -0.8, 0.2, -0.2, -2.3, -0.1, 2.5, 0.4;
  for (const double sign : {1.0, -1.0}) {
    push << 0, 0, 0, 0, 5, 5, -5;
    EXPECT_GT(PushAbove(0.015, 0.1, q, sign * push), 0);
    push << 0, 0, 0, 0, -3, 5, 2;
    EXPECT_GT(PushAbove(0.015, 0, q, sign * push), 0);
  }
}

}  // namespace
}  // namespace tether::control
