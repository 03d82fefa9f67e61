#include "tether/control/torque/joint_braking.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tether/common/random.h"

namespace tether::control {
namespace {

/// The same by small steps.
double Simulated(double v, double a, const Braking& braking) {
  const double dt = 1e-5;
  double q = 0, most = 0;
  for (int i = 0; i < 1000000 && (v > 0 || a > 0); ++i) {
    a = std::max(-braking.deceleration, a - braking.jerk * dt);
    v += a * dt;
    q += v * dt;
    most = std::max(most, q);
  }
  return most;
}

TEST(JointBraking, TheStoppingDistanceIsThatOfTheMotion) {
  Random random(1);
  for (int trial = 0; trial < 40; ++trial) {
    const Braking braking{random.Uniform(1, 15), random.Uniform(20, 500)};
    const double v = random.Uniform(-0.2, 2), a = random.Uniform(-braking.deceleration, 10);
    EXPECT_NEAR(StoppingDistance(v, a, braking), Simulated(v, a, braking), 2e-4) << v << " " << a;
  }
}

// Whatever is asked for, a joint that follows the bound neither passes its limit nor its speed, and needs no
// more jerk than it has.
TEST(JointBraking, AJointThatFollowsTheBoundsStaysWithinItsLimits) {
  Random random(3);
  const double dt = 0.001;
  for (int trial = 0; trial < 30; ++trial) {
    const Braking braking{random.Uniform(2, 12), random.Uniform(60, 600)};
    const double limit = random.Uniform(0.05, 2), fastest = random.Uniform(0.3, 2.5);
    double q = 0, v = 0, a = 0, fastest_seen = 0;
    for (int i = 0; i < 4000; ++i) {
      const double speed = MostAccelerationToKeepSpeed(fastest - v, 15, dt, braking);
      const double most = MostAccelerationToStop(limit - q, v, std::min(15.0, speed), 15, 0.1, dt, braking);
      EXPECT_GE(most, a - 1.02 * braking.jerk * dt) << "trial " << trial << " tick " << i;
      a = std::min(most, a + 7.5);
      q += v * dt + 0.5 * a * dt * dt;
      v += a * dt;
      fastest_seen = std::max(fastest_seen, v);
      ASSERT_LE(q, limit + 1e-9);
      ASSERT_LE(v, fastest + 1e-9);
    }
    EXPECT_GT(q, limit - 0.02) << trial;
  }
}

TEST(JointBraking, AJointBeyondItsLimitComesBackSlowly) {
  const Braking braking{5, 200};
  double q = 0.3, v = 0;
  double fastest = 0;
  for (int i = 0; i < 5000; ++i) {
    const double a = MostAccelerationToStop(-q, v, 15, 15, 0.1, 0.001, braking);
    q += 0.001 * v;
    v += 0.001 * a;
    fastest = std::max(fastest, std::abs(v));
  }
  EXPECT_LT(q, 0.002);
  EXPECT_LE(fastest, 0.1 + 1e-9);
}

TEST(JointBraking, ASpeedBeyondTheLimitGoesAtABoundedRate) {
  EXPECT_DOUBLE_EQ(MostAccelerationToKeepSpeed(-0.1, 15, 0.001, {5, 200}), -3);
  EXPECT_DOUBLE_EQ(MostAccelerationToKeepSpeed(-10, 15, 0.001, {5, 200}), -15);
}

TEST(JointBraking, TheReserveIsThereForAllJointsAtOnce) {
  const auto model = robot::Model::Load("panda");
  robot::State state(model);
  BrakingReserve reserve(*model);
  Random random(7);
  for (int trial = 0; trial < 50; ++trial) {
    Eigen::VectorXd q(7), a(7), j(7);
    for (int i = 0; i < 7; ++i) q[i] = random.Uniform(model->lower()[i], model->upper()[i]);
    state.Set(q, Eigen::VectorXd::Zero(7));
    reserve.Set(state.M(), state.bias(), 1, 1);
    for (int i = 0; i < 7; ++i) {
      const double sign = random.Uniform(-1, 1) > 0 ? 1 : -1;
      a[i] = sign * reserve.of(i).deceleration;
      j[i] = sign * reserve.of(i).jerk;
    }
    const Eigen::VectorXd torque = state.M() * a + state.bias(), rate = state.M() * j;
    for (int i = 0; i < 7; ++i) {
      EXPECT_LE(std::abs(torque[i]), model->max_torque()[i] + 1e-9);
      EXPECT_LE(std::abs(rate[i]), model->max_torque_rate()[i] + 1e-9);
    }
  }
}

}  // namespace
}  // namespace tether::control
