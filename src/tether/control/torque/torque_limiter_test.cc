#include "tether/control/torque/torque_limiter.h"

#include <cmath>
#include <functional>
#include <limits>
#include <string>

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

/// What may come in.
struct Garbage {
  std::string name;
  std::function<double(int tick, int joint, Random& random)> torque;
};

void PrintTo(const Garbage& garbage, std::ostream* out) { *out << garbage.name; }

class LimiterInputs : public ::testing::TestWithParam<Garbage> {};

// The arm moves as its model says, so each tick is the limiter's own prediction of one step: what goes out is
// within torque and rate, and leaves no joint beyond its velocity or position.
TEST_P(LimiterInputs, WhateverComesInWhatGoesOutIsWithinAllLimits) {
  Random random(31);
  const Worst worst = RunLimited(4000, [&](int tick, const Arm&) {
    Eigen::VectorXd torque(7);
    for (int i = 0; i < 7; ++i) torque[i] = GetParam().torque(tick, i, random);
    return torque;
  });
  EXPECT_GE(worst.torque, 0);
  EXPECT_GE(worst.rate, -1e-6);
  EXPECT_GE(worst.velocity, 0);
  EXPECT_GE(worst.position, 0);
}

constexpr double kInf = std::numeric_limits<double>::infinity();
const double kNan = std::nan("");

INSTANTIATE_TEST_SUITE_P(
    Kinds, LimiterInputs,
    ::testing::Values(
        Garbage{"NotANumber", [](int, int, Random&) { return kNan; }},
        Garbage{"Infinite",
                [](int tick, int joint, Random&) { return (tick / 300 + joint) % 2 ? kInf : -kInf; }},
        Garbage{"Huge", [](int tick, int, Random&) { return tick / 400 % 2 ? 1e308 : -1e308; }},
        Garbage{"Tiny", [](int, int, Random&) { return 5e-324; }},
        Garbage{"SignFlipsEachTick", [](int tick, int, Random&) { return tick % 2 ? 80.0 : -80.0; }},
        Garbage{"Jumps", [](int tick, int joint, Random&) { return (tick / 100 + joint) % 3 * 60.0 - 60; }},
        Garbage{"OneJointOnly", [](int tick, int joint, Random&) { return joint == tick / 800 ? 87.0 : 0; }},
        Garbage{"Noise", [](int, int, Random& random) { return random.Uniform(-300, 300); }},
        Garbage{"NowAndThenNone",
                [](int tick, int joint, Random&) { return tick % 7 == 0 ? kNan
                                                          : joint % 2   ? 40.0
                                                                        : -40; }}),
    [](const auto& given) { return given.param.name; });

// An arm whose measured state is not finite, or far off for a tick, gets torques within their limits all the
// same, and is not led beyond its own.
TEST(TorqueLimiter, AStateThatIsWrongForATickLeadsNowhere) {
  Arm arm;
  TorqueLimiter limiter(arm.model, {});
  robot::State seen(arm.model);
  Eigen::VectorXd last = arm.state.bias();
  for (int i = 0; i < 4000; ++i) {
    Eigen::VectorXd q = arm.q, v = arm.v;
    if (i % 40 == 10) q[i / 40 % 7] += 0.5;
    if (i % 40 == 20) v[i / 40 % 7] = -9;
    if (i % 40 == 30) q[i / 40 % 7] = kNan;
    seen.Set(q, v);
    const Eigen::VectorXd torque = arm.state.bias() + Eigen::VectorXd::Constant(7, i / 500 % 2 ? 25 : -25);
    const Eigen::VectorXd out = limiter.Limit(seen, torque);
    ASSERT_TRUE(out.allFinite());
    ASSERT_GE((arm.model->max_torque() - out.cwiseAbs()).minCoeff(), 0);
    ASSERT_GE((0.001 * arm.model->max_torque_rate() - (out - last).cwiseAbs()).minCoeff(), -1e-9);
    last = out;
    arm.Step(out);
    ASSERT_GE((arm.model->max_velocity() - arm.v.cwiseAbs()).minCoeff(), 0) << i;
    ASSERT_GE((arm.q - arm.model->lower()).minCoeff(), 0) << i;
    ASSERT_GE((arm.model->upper() - arm.q).minCoeff(), 0) << i;
  }
}

// Too few torques, or none, are none that are known.
TEST(TorqueLimiter, TorquesOfTheWrongSizeHoldTheArm) {
  Arm arm;
  for (const int size : {0, 3}) {
    TorqueLimiter limiter(arm.model, {});
    const Eigen::VectorXd out = limiter.Limit(arm.state, Eigen::VectorXd::Zero(size));
    ASSERT_EQ(out.size(), 7);
    EXPECT_EQ(out.tail(4), arm.state.bias().tail(4));
    EXPECT_TRUE(limiter.flags().not_finite);
  }
}

}  // namespace
}  // namespace tether::control
