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

// A joint that starts beyond its limit comes back inside, slowly, and it is said.
TEST(ConstrainedTorque, AJointThatStartsBeyondItsLimitComesBackAtABoundedRate) {
  for (const bool upper : {false, true}) {
    TorqueArm arm;
    Eigen::VectorXd q = arm.model->home();
    const double limit = upper ? arm.model->upper()[3] : arm.model->lower()[3];
    q[3] = limit + (upper ? 0.05 : -0.05);
    arm.Put(q, Eigen::VectorXd::Zero(7));
    ConstrainedTorque controller(arm.model, Pose(), {}, {}, {}, {});
    HandTarget target;
    target.X_BH = arm.state.X_BH();
    int outside = 0;
    double fastest = 0;
    for (int i = 0; i < 3000; ++i) {
      arm.Step(controller.Compute({arm.state, 0.04, {}}, {&target, nullptr, &q}));
      outside += controller.flags().outside ? 1 : 0;
      if (upper ? arm.q[3] > limit : arm.q[3] < limit) fastest = std::max(fastest, std::abs(arm.v[3]));
    }
    EXPECT_GT(outside, 100);
    EXPECT_LT(outside, 1500);
    EXPECT_LT(fastest, 1.1 * controller.options().return_speed);
    EXPECT_TRUE(upper ? arm.q[3] < limit : arm.q[3] > limit);
    EXPECT_GE(arm.velocity_room, 0);
  }
}

// What the hand holds is led through a wall that is wide of the hand itself.
TEST(ConstrainedTorque, WhatIsHeldKeepsItsDistanceToo) {
  TorqueArm arm;
  const std::vector<Solid> solids = {{"wall", geometry::Primitive(geometry::Box{{0.04, 1.0, 0.2}}), false},
                                     {"stick", geometry::Primitive(geometry::Box{{0.03, 0.03, 0.3}}), true}};
  const Pose X_HO(Vector3d(0, 0, 0.12));
  const double start = arm.state.X_BH().p.x();
  std::vector<MovingPose> poses = {{Pose(Vector3d(start + 0.15, 0, 0.22))}, {}};
  ConstrainedTorque controller(arm.model, Pose(), solids, {KeepClear(*arm.model, {0, 1})}, {}, {});
  controller.Hold(1);
  HandTarget target;
  target.X_BH = arm.state.X_BH();
  double nearest = 1e9;
  for (int i = 0; i < 4000; ++i) {
    target.X_BH.p.x() = start + std::min(0.3, 1e-4 * i);
    poses[1].X = arm.state.X_BH() * X_HO;
    arm.Step(controller.Compute({arm.state, 0.04, poses}, {&target, nullptr, &arm.model->home()}));
    nearest = std::min(nearest, geometry::SignedDistance(solids[0].shape, poses[0].X, solids[1].shape,
                                                         arm.state.X_BH() * X_HO)
                                    .distance);
  }
  EXPECT_GT(nearest, 0.01 - 0.0005);
  EXPECT_LT(nearest, 0.02);
  EXPECT_EQ(arm.Exceeded(), "");
}

// The hand is led into the arm's own links, above its base.
TEST(ConstrainedTorque, TheArmKeepsClearOfItself) {
  TorqueArm arm;
  ConstrainedTorque controller(arm.model, Pose(), {}, {}, {}, {});
  HandTarget target;
  target.X_BH = arm.state.X_BH();
  const Vector3d start = target.X_BH.p, inside(0, 0, 0.3);
  double nearest = 1e9;
  for (int i = 0; i < 6000; ++i) {
    target.X_BH.p = start + std::min(1.0, i / 4000.0) * (inside - start);
    arm.Step(controller.Compute({arm.state, 0.04, {}}, {&target, nullptr, nullptr, 200}));
    const ArmBodies& bodies = controller.bodies();
    for (const auto& [a, b] : arm.model->solids().pairs) {
      for (const auto* p = bodies.begin(a); p != bodies.end(a); ++p) {
        for (const auto* r = bodies.begin(b); r != bodies.end(b); ++r) {
          nearest = std::min(nearest,
                             geometry::SignedDistance(p->primitive, p->X_BP, r->primitive, r->X_BP).distance);
        }
      }
    }
  }
  EXPECT_GT(nearest, controller.options().self_distance - 0.0005);
  EXPECT_LT(nearest, 0.01) << "it never came near";
  EXPECT_EQ(arm.Exceeded(), "");
}

// Where no limit asks for more, accelerations change no faster than they may.
TEST(ConstrainedTorque, AMotionIsAsSmoothAsTheJerkAllows) {
  TorqueArm arm;
  ConstrainedTorque controller(arm.model, Pose(), {}, {}, {}, {});
  HandTarget target;
  target.X_BH = arm.state.X_BH();
  target.X_BH.p.y() += 0.15;
  Eigen::VectorXd last = Eigen::VectorXd::Zero(7), largest = last;
  for (int i = 0; i < 1500; ++i) {
    controller.Compute({arm.state, 0.04, {}}, {&target, nullptr, &arm.model->home(), 500});
    const Eigen::VectorXd jerk = (controller.acceleration() - last).cwiseAbs() / 0.001;
    last = controller.acceleration();
    largest = largest.cwiseMax(jerk.cwiseQuotient(arm.model->max_jerk()));
    arm.Step(arm.state.M() * last + arm.state.bias());
  }
  EXPECT_LT(largest.maxCoeff(), 1.001);
  EXPECT_GT(largest.maxCoeff(), 0.5) << "nothing had to be smoothed";
}

// Blocked by something that nobody sees, velocities are followed with no more force than is allowed.
TEST(ConstrainedTorque, TheForceOfVelocitiesIsBounded) {
  for (const double most : {20.0, 40.0}) {
    TorqueArm arm;
    ConstrainedTorque controller(arm.model, Pose(), {}, {}, {}, {});
    const Eigen::VectorXd velocities =
        arm.state.J_BH().transpose() * (math::Vector6d() << 4, 0, 0, 0, 0, 0).finished();
    TorqueTask task;
    task.velocities = &velocities;
    task.max_force = most;
    Eigen::VectorXd torque;
    // The arm is held where it is.
    for (int i = 0; i < 1000; ++i) torque = controller.Compute({arm.state, 0.04, {}}, task);
    EXPECT_TRUE(controller.flags().force_limit);
    const Eigen::VectorXd pressing = torque - arm.state.bias();
    const math::Vector6d force = arm.state.J_BH().transpose().colPivHouseholderQr().solve(pressing);
    EXPECT_LT(force.head<3>().norm(), 1.2 * most);
  }
}

}  // namespace
}  // namespace tether::control
