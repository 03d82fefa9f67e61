#include "tether/control/torque/constrained_torque.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "testing/control/torque_arm.h"

namespace tether::control {
namespace {

using Eigen::Vector3d;
using math::Pose;

// Two walls that close on the arm: distances are violated, the joints' limits do not, and it is said.
TEST(ConstrainedTorque, WhereRowsConflictTorqueVelocityAndPositionHold) {
  TorqueArm arm;
  std::vector<Solid> solids = {{"left", geometry::Primitive(geometry::Box{{1.0, 0.04, 1.4}}), false},
                               {"right", geometry::Primitive(geometry::Box{{1.0, 0.04, 1.4}}), false}};
  std::vector<MovingPose> poses = {{Pose(Vector3d(0.5, 0.4, 0.5))}, {Pose(Vector3d(0.5, -0.4, 0.5))}};
  ConstrainedTorque controller(arm.model, Pose(), solids, {KeepClear(*arm.model, {0, 1})}, {}, {});
  HandTarget target;
  target.X_BH = arm.state.X_BH();
  int relaxed = 0, worst = -1;
  for (int i = 0; i < 3000; ++i) {
    const bool closing = i > 300 && i < 1900;
    for (int wall = 0; wall < 2; ++wall) {
      auto& pose = poses[static_cast<size_t>(wall)];
      pose.V[1] = closing ? (wall == 0 ? -0.22 : 0.22) : 0;
      pose.X.p.y() += 0.001 * pose.V[1];
    }
    arm.Step(controller.Compute({arm.state, 0.04, poses}, {&target, nullptr, &arm.model->home()}));
    if (controller.flags().relaxed) worst = controller.flags().worst;
    relaxed += controller.flags().relaxed ? 1 : 0;
    ASSERT_FALSE(controller.flags().fault);
  }
  EXPECT_GT(relaxed, 0);
  ASSERT_GE(worst, 0);
  EXPECT_EQ(controller.constraint_name(worst), "clearance");
  // Acceleration is relaxed before distances are.
  EXPECT_EQ(arm.Exceeded(false), "");
}

// The hand between a wall that may not be passed and one that may: the one with `relax` is violated.
TEST(ConstrainedTorque, WhatMayBeRelaxedGivesWayFirst) {
  for (const bool left_gives : {false, true}) {
    TorqueArm arm;
    std::vector<Solid> solids = {{"left", geometry::Primitive(geometry::Box{{0.4, 0.04, 0.4}}), false},
                                 {"right", geometry::Primitive(geometry::Box{{0.4, 0.04, 0.4}}), false}};
    std::vector<MovingPose> poses = {{Pose(Vector3d(0.6, 0.25, 0.5))}, {Pose(Vector3d(0.6, -0.25, 0.5))}};
    ConstrainedTorque controller(arm.model, Pose(), solids,
                                 {KeepClear(*arm.model, {0}, 0.01, left_gives ? 2 : 0),
                                  KeepClear(*arm.model, {1}, 0.01, left_gives ? 0 : 2)},
                                 {}, {});
    HandTarget target;
    target.X_BH = Pose(math::RotationFromRpy({M_PI, 0, 0}), Vector3d(0.55, 0, 0.5));
    double left = 1e9, right = 1e9;
    for (int i = 0; i < 4000; ++i) {
      const bool closing = i > 1500 && i < 2300;
      for (int wall = 0; wall < 2; ++wall) {
        auto& pose = poses[static_cast<size_t>(wall)];
        pose.V[1] = closing ? (wall == 0 ? -0.25 : 0.25) : 0;
        pose.X.p.y() += 0.001 * pose.V[1];
      }
      arm.Step(controller.Compute({arm.state, 0.04, poses}, {&target, nullptr, &arm.model->home()}));
      left = std::min(left, LeastDistance(controller.bodies(), 0));
      right = std::min(right, LeastDistance(controller.bodies(), 1));
    }
    EXPECT_GT(left_gives ? right : left, 0.0075) << left_gives << left << " " << right;
    EXPECT_LT(left_gives ? left : right, 0.004) << left_gives;
    EXPECT_EQ(arm.Exceeded(false), "");
  }
}

}  // namespace
}  // namespace tether::control
