#include "tether/execution/monitor/observation_guard.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/execution/monitor/fault_watch.h"

namespace tether::execution {
namespace {

using Trouble = ObservationGuard::Trouble;
using ::testing::HasSubstr;

constexpr double kPeriod = 0.001;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// An arm that its torques move, and what is seen of it.
struct Arm {
  std::shared_ptr<const robot::Model> model = robot::Model::Load("panda");
  robot::State state{model};
  robot::Observation seen;
  robot::Command told;
  ObservationGuard guard{model, Eigen::Vector3d(0, 0, -robot::kGravity), kPeriod};

  Arm() {
    seen.q = model->home();
    seen.v = seen.tau_external = Eigen::VectorXd::Zero(7);
    state.Set(seen.q, seen.v);
    told.torque = state.bias();
    Take();
  }
  void Take() { guard.Take(seen, told, nullptr); }
  /// Torques that swing the arm about, for one period.
  void Move() {
    Eigen::VectorXd a(7);
    for (int i = 0; i < 7; ++i) a[i] = 2 * std::sin(5 * seen.time + i) - 2 * seen.v[i];
    told.torque = state.M() * a + state.bias();
    seen.v += kPeriod * a;
    seen.q += kPeriod * seen.v;
    seen.time += kPeriod;
    state.Set(seen.q, seen.v);
  }
};

TEST(ObservationGuard, WhatCanBeBelievedIsUnchanged) {
  Arm arm;
  for (int i = 0; i < 1000; ++i) {
    arm.Move();
    arm.Take();
    ASSERT_EQ(arm.guard.trouble(), Trouble::kFine);
    ASSERT_EQ(arm.guard.believed().q, arm.seen.q);
    ASSERT_EQ(arm.guard.believed().v, arm.seen.v);
    ASSERT_EQ(arm.guard.believed().time, arm.seen.time);
  }
}

TEST(ObservationGuard, WithoutMeasurementsTheArmIsWhereItsTorquesLedIt) {
  for (const bool silent : {true, false}) {
    Arm arm;
    for (int i = 0; i < 300; ++i) {
      arm.Move();
      arm.Take();
    }
    robot::Observation last = arm.seen;
    if (!silent) last.q[2] = kNan;
    for (int i = 0; i < 200; ++i) {
      arm.Move();
      arm.guard.Take(last, arm.told, nullptr);
      ASSERT_EQ(arm.guard.trouble(), silent ? Trouble::kSilence : Trouble::kNotFinite);
    }
    EXPECT_LT((arm.guard.believed().q - arm.seen.q).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_NEAR(arm.guard.believed().time, arm.seen.time, 1e-9);
    EXPECT_THAT(arm.guard.Describe("panda"),
                HasSubstr(silent ? "no measurement of 'panda' comes" : "measured of 'panda' is not finite"));
    arm.Move();
    arm.Take();
    EXPECT_EQ(arm.guard.trouble(), Trouble::kFine);
    EXPECT_EQ(arm.guard.believed().q, arm.seen.q);
  }
}

TEST(ObservationGuard, VelocitiesThatWereToldAreFollowed) {
  Arm arm;
  arm.told.mode = robot::Command::Mode::kVelocity;
  arm.told.velocity = Eigen::VectorXd::Constant(7, 0.1);
  for (int i = 0; i < 50; ++i) arm.Take();
  EXPECT_EQ(arm.guard.trouble(), Trouble::kSilence);
  const Eigen::VectorXd moved = arm.guard.believed().q - arm.model->home();
  EXPECT_LT((moved - Eigen::VectorXd::Constant(7, 0.005)).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(ObservationGuard, AJointThatJumpsIsFollowedByItsVelocityUntilItIsBack) {
  for (const int joint : {0, 3, 6}) {
    Arm arm;
    for (int i = 0; i < 300; ++i) {
      arm.Move();
      arm.Take();
    }
    for (int i = 0; i < 500; ++i) {
      arm.Move();
      robot::Observation off = arm.seen;
      off.q[joint] += 0.3;
      arm.guard.Take(off, arm.told, nullptr);
      ASSERT_EQ(arm.guard.trouble(), Trouble::kJump);
      ASSERT_LT((arm.guard.believed().q - arm.seen.q).cwiseAbs().maxCoeff(), 1e-6) << i;
    }
    EXPECT_EQ(arm.guard.Describe("panda"), arm.model->joint_names()[static_cast<size_t>(joint)] +
                                               " of 'panda' seems to have jumped by 0.300 rad");
    arm.Move();
    arm.Take();
    EXPECT_EQ(arm.guard.trouble(), Trouble::kFine);
  }
}

TEST(ObservationGuard, ASpeedThatNoJointHasIsNotBelieved) {
  Arm arm;
  arm.Move();
  robot::Observation off = arm.seen;
  off.v[4] = 40;
  arm.guard.Take(off, arm.told, nullptr);
  EXPECT_EQ(arm.guard.trouble(), Trouble::kJump);
  EXPECT_LT(std::abs(arm.guard.believed().v[4]), 0.1);
}

// After some time without measurements the arm may be elsewhere.
TEST(ObservationGuard, AnArmThatWasMovedMeanwhileIsBelieved) {
  Arm arm;
  for (int i = 0; i < 300; ++i) arm.Take();
  arm.seen.time += 0.3;
  arm.seen.q[1] += 0.2;
  arm.Take();
  EXPECT_EQ(arm.guard.trouble(), Trouble::kFine);
  EXPECT_EQ(arm.guard.believed().q, arm.seen.q);
}

TEST(ObservationGuard, TimeGoesOnWhereTheClockJumps) {
  for (const double jump : {5.0, -5.0, 0.1}) {
    Arm arm;
    arm.seen.time = 10;
    arm.Take();
    double before = arm.guard.believed().time;
    for (int i = 0; i < 100; ++i) {
      arm.Move();
      if (i == 50) arm.seen.time += jump;
      arm.Take();
      ASSERT_EQ(arm.guard.trouble(), i == 50 ? Trouble::kClock : Trouble::kFine) << jump << " " << i;
      ASSERT_NEAR(arm.guard.believed().time, before + kPeriod, 1e-9);
      before = arm.guard.believed().time;
    }
    EXPECT_EQ(arm.guard.Describe("panda"), "the clock of 'panda' has jumped by " +
                                               std::string(jump < 0   ? "-5.000"
                                                           : jump > 1 ? "5.000"
                                                                      : "0.100") +
                                               " s");
  }
}

TEST(ObservationGuard, TorquesThatAreNotFiniteAreThoseBefore) {
  Arm arm;
  arm.seen.tau_external.setConstant(2);
  arm.Move();
  arm.Take();
  arm.seen.tau_external[3] = kNan;
  arm.Move();
  arm.Take();
  EXPECT_EQ(arm.guard.trouble(), Trouble::kNotFinite);
  EXPECT_EQ(arm.guard.believed().q, arm.seen.q);
  EXPECT_EQ(arm.guard.believed().tau_external[3], 2);
}

TEST(FaultWatch, WhatPassesIsBorneAndWhatLastsIsNot) {
  FaultWatch watch({.silence = 0.02, .pose_silence = 0.5, .steady = 0.05, .lasting = 1});
  int tick = 0, began = 0, ended = 0, lasts = 0, first = 0;
  const auto run = [&](int ticks, bool wrong) {
    for (int i = 0; i < ticks; ++i) {
      watch.Update(kPeriod * tick++, wrong, 0.02);
      began += watch.began();
      ended += watch.ended();
      lasts += watch.lasts();
      first += watch.first();
    }
  };
  run(10, false);
  run(10, true);
  run(10, false);
  EXPECT_EQ(first, 1);
  EXPECT_EQ(began, 0);
  run(100, true);
  EXPECT_TRUE(watch.stopped());
  EXPECT_EQ(began, 1);
  run(40, false);
  EXPECT_TRUE(watch.stopped());
  run(1, true);
  run(45, false);
  EXPECT_TRUE(watch.stopped());
  run(20, false);
  EXPECT_FALSE(watch.stopped());
  EXPECT_EQ(ended, 1);
  EXPECT_EQ(lasts, 0);
  run(999, true);
  EXPECT_EQ(lasts, 0);
  run(10, true);
  EXPECT_GT(lasts, 0);
}

}  // namespace
}  // namespace tether::execution
