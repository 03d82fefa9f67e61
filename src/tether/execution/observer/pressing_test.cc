// What a hand that is told velocities presses on, and when it may touch its target.

#include <algorithm>

#include <gtest/gtest.h>

#include "testing/execution/fake_arm.h"

namespace tether::execution {
namespace {

using Eigen::Vector3d;
using math::Pose;

/// The hand's height over time while a force (N, in the world) is on it for `pressed` s.
struct Pressing {
  double most_rise = 0, most_fall = 0;  ///< From where it was as the force began, m.
  bool said = false;
  bool done = false;
};

Pressing Press(const Vector3d& force, double pressed) {
  FakeArm fake;
  fake.Start({"move(left)", "grasp(block,left)"});
  robot::Kinematics kinematics(Jaco());
  Eigen::MatrixXd J(6, 6);
  Pressing pressing;
  double since = -1, height = 0;
  fake.Run(80, [&] {
    robot::Observation& seen = fake.observations["jaco"];
    kinematics.Set(seen.q);
    kinematics.HandJacobian(J);
    const double z = kinematics.X_BH().p.z();
    // On the way down to the block, 10 cm above it.
    if (since < 0 && fake.executive->step() == 2 && z < 0.2) {
      since = fake.truth.time;
      height = z;
    }
    const double for_s = since < 0 ? -1 : fake.truth.time - since;
    const bool on = for_s >= 0 && for_s < pressed;
    seen.tau_external = on ? Eigen::VectorXd(J.topRows<3>().transpose() * force) : Eigen::VectorXd::Zero(6);
    if (for_s >= 0 && for_s < 0.25) {
      pressing.most_rise = std::max(pressing.most_rise, z - height);
      pressing.most_fall = std::max(pressing.most_fall, height - z);
    }
  });
  pressing.said = fake.Happened(EventKind::kSafety, "more than is allowed; it backs off");
  pressing.done = fake.executive->status().state == ExecutiveStatus::State::kFinished;
  return pressing;
}

TEST(VelocityForce, TheHandBacksOffFromWhatItPressesOn) {
  const Pressing pressing = Press({0, 0, 60}, 0.1);
  EXPECT_TRUE(pressing.said);
  EXPECT_GT(pressing.most_rise, 0.005);
  EXPECT_LT(pressing.most_fall, 0.004);
  EXPECT_TRUE(pressing.done) << "it goes on afterwards";
}

TEST(VelocityForce, WhatIsAllowedIsPressed) {
  const Pressing pressing = Press({0, 0, 35}, 0.1);
  EXPECT_FALSE(pressing.said);
  EXPECT_LT(pressing.most_rise, 0.001);
  EXPECT_TRUE(pressing.done);
}

TEST(VelocityForce, OneTickIsNoContact) { EXPECT_FALSE(Press({0, 0, 80}, 0.004).said); }

// The target may be touched where the hand gets to it, not on the way there.
TEST(VelocityForce, TheTargetIsTouchedInTheLastReachOnly) {
  FakeArm fake;
  fake.Start({"move(left)", "grasp(block,left)"});
  double lowest_off = 1, highest_touching = 0;
  robot::Kinematics kinematics(Jaco());
  fake.Run(80, [&] {
    if (fake.executive->step() != 2 || !fake.held.empty()) return;
    kinematics.Set(fake.observations["jaco"].q);
    const double z = kinematics.X_BH().p.z();
    if (fake.executive->allowed().Allows(kTouchingHand, fake.scene.FindObjectId("block"))) {
      highest_touching = std::max(highest_touching, z);
    } else {
      lowest_off = std::min(lowest_off, z);
    }
  });
  ASSERT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
  EXPECT_LT(lowest_off, 0.25);
  EXPECT_GT(lowest_off, 0.15) << "kept off 13 cm above the grasp";
  EXPECT_GT(highest_touching, 0.1);
}

}  // namespace
}  // namespace tether::execution
