#include "tether/control/torque/torque_limiter.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tether/common/random.h"

namespace tether::control {
namespace {

/// The arm alone, integrated semi-implicitly.
struct Arm {
  std::shared_ptr<const robot::Model> model = robot::Model::Load("panda");
  robot::State state{model};
  Eigen::VectorXd q = model->home(), v = Eigen::VectorXd::Zero(7);

  void Step(const Eigen::VectorXd& torque, double dt = 0.001) {
    v += dt * state.M().llt().solve(torque - state.bias());
    q += dt * v;
    state.Set(q, v);
  }
};

struct Worst {
  double position = 1e300, velocity = 1e300, torque = 1e300, rate = 1e300;
};

/// Runs the arm on what `in` says, through the limiter.
template <typename In>
Worst RunLimited(int ticks, const In& in) {
  Arm arm;
  TorqueLimiter limiter(arm.model, {});
  Worst worst;
  Eigen::VectorXd last = arm.state.bias();
  for (int i = 0; i < ticks; ++i) {
    const Eigen::VectorXd out = limiter.Limit(arm.state, in(i, arm));
    EXPECT_TRUE(out.allFinite());
    worst.torque = std::min(worst.torque, (arm.model->max_torque() - out.cwiseAbs()).minCoeff());
    worst.rate =
        std::min(worst.rate, (arm.model->max_torque_rate() - (out - last).cwiseAbs() / 0.001).minCoeff());
    last = out;
    arm.Step(out);
    worst.position = std::min(
        {worst.position, (arm.q - arm.model->lower()).minCoeff(), (arm.model->upper() - arm.q).minCoeff()});
    worst.velocity = std::min(worst.velocity, (arm.model->max_velocity() - arm.v.cwiseAbs()).minCoeff());
  }
  return worst;
}

TEST(TorqueLimiter, GarbageStaysWithinAllLimits) {
  for (int seed = 0; seed < 6; ++seed) {
    Random random(100 + seed);
    Eigen::VectorXd torque = Eigen::VectorXd::Zero(7);
    int until = 0;
    const Worst worst = RunLimited(6000, [&](int tick, const Arm&) {
      if (tick >= until) {
        until = tick + static_cast<int>(random.Uniform(1, 700));
        for (int i = 0; i < 7; ++i) {
          const double kind = random.Uniform(0, 1);
          torque[i] = kind < 0.1   ? std::numeric_limits<double>::quiet_NaN()
                      : kind < 0.2 ? std::numeric_limits<double>::infinity()
                      : kind < 0.3 ? -1e300
                                   : random.Uniform(-200, 200);
        }
      }
      return torque;
    });
    EXPECT_GE(worst.torque, 0) << seed;
    EXPECT_GE(worst.rate, -1e-6) << seed;
    EXPECT_GE(worst.velocity, 0) << seed;
    EXPECT_GE(worst.position, 0) << seed;
  }
}

TEST(TorqueLimiter, LetsThroughWhatIsFine) {
  Arm arm;
  TorqueLimiter limiter(arm.model, {});
  const Eigen::VectorXd torque = arm.state.bias() + Eigen::VectorXd::Constant(7, 0.5);
  EXPECT_EQ(limiter.Limit(arm.state, torque), torque);
  EXPECT_FALSE(limiter.flags().rate || limiter.flags().motion || limiter.flags().torque);
}

TEST(TorqueLimiter, AJumpBecomesARampAndATorqueBeyondItsLimitIsCut) {
  Arm arm;
  TorqueLimiter limiter(arm.model, {});
  Eigen::VectorXd torque = arm.state.bias();
  torque[6] += 5;
  EXPECT_DOUBLE_EQ(limiter.Limit(arm.state, torque)[6], arm.state.bias()[6] + 1);
  EXPECT_TRUE(limiter.flags().rate);
  EXPECT_DOUBLE_EQ(limiter.Limit(arm.state, torque)[6], arm.state.bias()[6] + 2);
  torque[6] = 100;
  Eigen::VectorXd out;
  for (int i = 0; i < 30; ++i) out = limiter.Limit(arm.state, torque);
  EXPECT_LE(out[6], 12);
  EXPECT_TRUE(limiter.flags().torque);
}

TEST(TorqueLimiter, WhatIsNotFiniteHoldsTheArm) {
  const Worst worst = RunLimited(1000, [](int tick, const Arm& arm) -> Eigen::VectorXd {
    if (tick > 300) return Eigen::VectorXd::Constant(7, std::nan(""));
    return arm.state.bias() + 3 * (arm.model->home() - arm.q);
  });
  EXPECT_GE(worst.rate, -1e-6);
  Arm arm;
  TorqueLimiter limiter(arm.model, {});
  EXPECT_EQ(limiter.Limit(arm.state, Eigen::VectorXd::Constant(7, std::nan(""))), arm.state.bias());
  EXPECT_TRUE(limiter.flags().not_finite);
}

}  // namespace
}  // namespace tether::control
