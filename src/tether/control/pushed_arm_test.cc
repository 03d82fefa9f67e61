// An arm that is pushed: what is felt in the external torques counts where limits of joints are near.

#include <cmath>

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace tether::control
