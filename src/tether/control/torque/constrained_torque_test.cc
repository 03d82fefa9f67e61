#include "tether/control/torque/constrained_torque.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "testing/control/sign_changes.h"
#include "testing/control/torque_arm.h"
#include "tether/common/error.h"
#include "tether/common/random.h"
#include "tether/constraints/core/field_function.h"
#include "tether/control/objective.h"

namespace tether::control {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using math::Pose;

TEST(ConstrainedTorque, ConvergesToAPoseWithinAllLimits) {
  Random random(1);
  for (int trial = 0; trial < 5; ++trial) {
    TorqueArm arm;
    ConstrainedTorque controller(arm.model, Pose(), {}, {}, {}, {});
    HandTarget target;
    target.X_BH = arm.state.X_BH();
    target.X_BH.p +=
        Vector3d(random.Uniform(-0.1, 0.2), random.Uniform(-0.2, 0.2), random.Uniform(-0.2, 0.2));
    target.X_BH.R =
        math::ExpSO3(Vector3d(random.Uniform(-0.2, 0.2), random.Uniform(-0.2, 0.2), random.Uniform(-1, 1))) *
        target.X_BH.R;
    for (int i = 0; i < 4000; ++i) {
      arm.Step(controller.Compute({arm.state, 0.04, {}}, {&target, nullptr, &arm.model->home()}));
      ASSERT_FALSE(controller.flags().fault || controller.flags().braking || controller.flags().relaxed)
          << i << controller.flags().relaxed << controller.flags().worst << " "
          << controller.flags().violation;
    }
    EXPECT_LT((arm.state.X_BH().p - target.X_BH.p).norm(), 1e-3);
    EXPECT_LT(math::AngleBetween(arm.state.X_BH().R, target.X_BH.R), 4e-3);
    EXPECT_EQ(arm.Exceeded(), "");
  }
}

struct Tracking {
  double error = 0;  ///< Mean, m.
  double work = 0;   ///< ∫ |τ · q̇| dt, J.
};

/// A circle of 10 cm at 0.2 m/s, led with velocity and acceleration.
template <typename Compute>
Tracking TrackCircle(TorqueArm& arm, const Compute& compute) {
  Tracking tracking;
  HandTarget target;
  const Pose start = arm.state.X_BH();
  const double radius = 0.1, rate = 2;
  target.X_BH.R = start.R;
  int counted = 0;
  for (int i = 0; i < 8000; ++i) {
    const double t = 0.001 * i, c = std::cos(rate * t), s = std::sin(rate * t);
    target.X_BH.p = start.p + radius * Vector3d(0, s, c - 1);
    target.V_BH.head<3>() = radius * rate * Vector3d(0, c, -s);
    target.A_BH.head<3>() = -radius * rate * rate * Vector3d(0, s, c);
    const VectorXd torque = compute(target);
    if (i > 2000) {
      tracking.error += (arm.state.X_BH().p - target.X_BH.p).norm();
      tracking.work += 0.001 * std::abs(torque.dot(arm.v));
      ++counted;
    }
    arm.Step(torque);
  }
  tracking.error /= counted;
  return tracking;
}

// Where no row is active it tracks as the operational-space controller does.
TEST(ConstrainedTorque, TracksACircleAsOperationalSpaceControlDoes) {
  TorqueArm plain, arm;
  OperationalSpaceController reference(plain.model, {}, plain.model->home());
  ConstrainedTorque controller(arm.model, Pose(), {}, {}, {}, {});
  const Tracking before =
      TrackCircle(plain, [&](const HandTarget& target) { return reference.Compute(plain.state, target); });
  const Tracking now = TrackCircle(arm, [&](const HandTarget& target) {
    return controller.Compute({arm.state, 0.04, {}}, {&target, nullptr, &arm.model->home()});
  });
  EXPECT_LT(now.error, std::max(1e-4, 1.1 * before.error)) << before.error;
  EXPECT_LT(now.work, 1.1 * before.work) << before.work;
  EXPECT_EQ(arm.Exceeded(), "");
  RecordProperty("error_ratio", std::to_string(now.error / before.error));
  RecordProperty("work_ratio", std::to_string(now.work / before.work));
}

TEST(ConstrainedTorque, FollowsJointVelocities) {
  TorqueArm arm;
  ConstrainedTorque controller(arm.model, Pose(), {}, {}, {}, {});
  VectorXd wanted = VectorXd::Zero(7);
  TorqueTask task;
  task.velocities = &wanted;
  for (int i = 0; i < 4000; ++i) {
    for (int j = 0; j < 7; ++j) wanted[j] = 0.2 * std::sin(0.001 * i * (1 + 0.2 * j));
    arm.Step(controller.Compute({arm.state, 0.04, {}}, task));
    if (i > 200) {
      EXPECT_LT((arm.v - wanted).cwiseAbs().maxCoeff(), 0.012) << i;
    }
  }
  EXPECT_EQ(arm.Exceeded(), "");
}

// An arm that does not move whatever it is told: what holds it feels no more than is allowed.
TEST(ConstrainedTorque, VelocitiesArePressedForWithNoMoreThanIsAllowed) {
  for (const double most : {15.0, 40.0}) {
    TorqueArm arm;
    ConstrainedTorque controller(arm.model, Pose(), {}, {}, {}, {});
    VectorXd wanted = VectorXd::Zero(7);
    wanted[1] = 2;
    wanted[3] = -1;
    TorqueTask task;
    task.velocities = &wanted;
    task.max_force = most;
    double force = 0;
    for (int i = 0; i < 300; ++i) {
      const VectorXd excess = controller.Compute({arm.state, 0.04, {}}, task) - arm.state.bias();
      const Eigen::MatrixXd MinvJt = arm.state.M().llt().solve(arm.state.J_BH().transpose());
      const Eigen::MatrixXd mobility = arm.state.J_BH() * MinvJt;
      force = mobility.topLeftCorner<3, 3>()
                  .llt()
                  .solve(Vector3d((MinvJt.transpose() * excess).head<3>()))
                  .norm();
      EXPECT_TRUE(i < 20 || controller.flags().force_limit);
    }
    EXPECT_LT(force, 1.05 * most);
    EXPECT_GT(force, 0.3 * most);
  }
}

// Targets that jump anywhere, far out of reach, behind the base: no limit is passed, whatever they are.
TEST(ConstrainedTorque, LimitsHoldWhateverIsAskedFor) {
  for (int seed = 0; seed < 8; ++seed) {
    Random random(10 + seed);
    TorqueArm arm;
    ConstrainedTorque controller(arm.model, Pose(), {}, {}, {}, {});
    HandTarget target;
    target.X_BH = arm.state.X_BH();
    VectorXd posture = arm.model->home();
    int braking = 0;
    for (int i = 0; i < 6000; ++i) {
      if (i % 400 == 0) {
        for (int j = 0; j < 3; ++j) target.X_BH.p[j] = random.Uniform(-1.5, 1.5);
        target.X_BH.R =
            math::ExpSO3(Vector3d(random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(-3, 3)));
        for (int j = 0; j < 7; ++j) posture[j] = random.Uniform(-4, 4);
      }
      arm.Step(controller.Compute({arm.state, 0.04, {}}, {&target, nullptr, &posture, 200}));
      braking += controller.flags().braking ? 1 : 0;
      ASSERT_FALSE(controller.flags().fault);
    }
    EXPECT_EQ(arm.Exceeded(), "");
    EXPECT_EQ(braking, 0) << seed;
  }
}

// A load that the arm cannot carry: torques stop at their limit, and get there no faster than they may.
TEST(ConstrainedTorque, TorquesStayWithinTheirLimitsUnderAnyLoad) {
  for (const double load : {400.0, -400.0}) {
    TorqueArm arm;
    ConstrainedTorque controller(arm.model, Pose(), {}, {}, {}, {});
    HandTarget target;
    target.X_BH = arm.state.X_BH();
    int at_limit = 0;
    for (int i = 0; i < 600; ++i) {
      target.F_BH = math::Vector6d::Zero();
      if (i > 10) target.F_BH << 0, 0, load, 0, 0.1 * load, 0.1 * load;
      const VectorXd& torque =
          controller.Compute({arm.state, 0.04, {}}, {&target, nullptr, &arm.model->home()});
      at_limit += controller.flags().torque_limit ? 1 : 0;
      arm.Step(torque, -arm.state.J_BH().transpose() * target.F_BH);
    }
    EXPECT_GT(at_limit, 0);
    EXPECT_GE(arm.torque_room, 0);
    EXPECT_GE(arm.rate_room, 0);
  }
}

// The hand is led through a wall, and a link through a post: both stop before, and stay.
TEST(ConstrainedTorque, NothingComesNearerThanItMay) {
  for (const bool moving : {false, true}) {
    TorqueArm arm;
    std::vector<Solid> solids = {{"wall", geometry::Primitive(geometry::Box{{0.04, 1.0, 1.0}}), false},
                                 {"post", geometry::Primitive(geometry::Cylinder{0.05, 1.0}), false}};
    std::vector<MovingPose> poses = {{Pose(Vector3d(0.75, 0, 0.5))}, {Pose(Vector3d(0.35, 0.45, 0.5))}};
    ConstrainedTorque controller(arm.model, Pose(), solids, {KeepClear(*arm.model, {0, 1})}, {}, {});
    HandTarget target;
    target.X_BH = arm.state.X_BH();
    double nearest = 1e9;
    for (int i = 0; i < 8000; ++i) {
      target.X_BH.p = i < 3000 ? Vector3d(1.2, 0, 0.5) : Vector3d(0.2, 0.8, 0.5);
      if (moving && i > 100 && i < 1100) {
        poses[0].X.p.x() -= 0.0002;
        poses[0].V[0] = -0.2;
      } else {
        poses[0].V.setZero();
      }
      arm.Step(controller.Compute({arm.state, 0.04, poses}, {&target, nullptr, &arm.model->home()}));
      nearest =
          std::min({nearest, LeastDistance(controller.bodies(), 0), LeastDistance(controller.bodies(), 1)});
      ASSERT_FALSE(controller.flags().fault || controller.flags().braking) << i;
    }
    EXPECT_GT(nearest, 0.01 - 0.0005) << moving;
    EXPECT_LT(nearest, 0.02);
    EXPECT_EQ(arm.Exceeded(), "");
  }
}

// At an obstacle the arm stands still: no joint goes to and fro.
TEST(ConstrainedTorque, StandsStillAtAnObstacle) {
  TorqueArm arm;
  std::vector<Solid> solids = {{"wall", geometry::Primitive(geometry::Box{{0.04, 1.0, 1.0}}), false}};
  std::vector<MovingPose> poses = {{Pose(Vector3d(0.65, 0, 0.5))}};
  ConstrainedTorque controller(arm.model, Pose(), solids, {KeepClear(*arm.model, {0})}, {}, {});
  HandTarget target;
  target.X_BH = arm.state.X_BH();
  target.X_BH.p.x() = 0.9;
  SignChanges changes(7);
  for (int i = 0; i < 12000; ++i) {
    arm.Step(controller.Compute({arm.state, 0.04, poses}, {&target, nullptr, &arm.model->home()}));
    if (i > 2000) changes.Observe(0.001 * i, arm.v);
  }
  EXPECT_EQ(changes.count(), 0);
  EXPECT_LT(arm.v.norm(), 5e-3);
}

TEST(ConstrainedTorque, FieldsHold) {
  TorqueArm arm;
  // The hand points down within 0.3 rad, and stays out of a cylinder about the world's z axis.
  std::vector<FieldConstraint> fields = {
      {"tilt", constraints::MakeAngle(Vector3d::UnitZ(), -Vector3d::UnitZ(), 0.3), {}, {}},
      {"outside",
       constraints::MakeAxisDistance(Vector3d::Zero(), Vector3d::UnitZ(), Vector3d::Zero(), 0.33, -1),
       {},
       {}}};
  ConstrainedTorque controller(arm.model, Pose(), {}, {}, fields, {});
  HandTarget target;
  target.X_BH = arm.state.X_BH();
  double most_tilt = 0, least_radius = 1;
  for (int i = 0; i < 6000; ++i) {
    target.X_BH.p = i < 3000 ? Vector3d(0.3, 0.1, 0.4) : Vector3d(0.1, -0.5, 0.4);
    const double phase = 0.0015 * i;
    target.X_BH.R = math::ExpSO3(Vector3d(0.6 * std::sin(phase), 0.3 * std::sin(1.3 * phase), 0)) *
                    math::RotationFromRpy({M_PI, 0, 0});
    arm.Step(controller.Compute({arm.state, 0.04, {}}, {&target, nullptr, &arm.model->home()}));
    most_tilt = std::max(most_tilt, std::acos(std::clamp(-arm.state.X_BH().R(2, 2), -1.0, 1.0)));
    least_radius = std::min(least_radius, arm.state.X_BH().p.head<2>().norm());
  }
  EXPECT_LT(most_tilt, 0.3);
  EXPECT_GT(most_tilt, 0.28);
  EXPECT_GT(least_radius, 0.33);
  EXPECT_LT(least_radius, 0.34);
  EXPECT_EQ(arm.Exceeded(), "");
}

// Objectives of the velocity controller's verbs: a place in a frame that moves, with a speed.
TEST(ConstrainedTorque, ObjectivesAreReachedWithoutTheirSpeedBeingExceeded) {
  for (const Objective objective : {Objective::kPosition, Objective::kLine, Objective::kPlane}) {
    TorqueArm arm;
    std::vector<Solid> solids = {{"cart", geometry::Primitive(geometry::Box{{0.05, 0.05, 0.05}}), true}};
    std::vector<MovingPose> poses = {{Pose(Vector3d(0.45, -0.2, 0.3))}};
    poses[0].V[1] = 0.05;
    ConstrainedTorque controller(arm.model, Pose(), solids, {}, {}, {});
    Goal goal;
    goal.target.object = 0;
    goal.speed = 0.1;
    goal.functions =
        MakeObjective(objective, Pose(math::RotationFromRpy({M_PI, 0, 0}), Vector3d(0.02, 0.01, 0.1)));
    double fastest = 0;
    for (int i = 0; i < 5000; ++i) {
      poses[0].X.p.y() += 0.00005;
      arm.Step(controller.Compute({arm.state, 0.04, poses}, {nullptr, &goal, &arm.model->home()}));
      if (i > 500) {
        fastest = std::max(fastest, (Vector3d(arm.HandVelocity().head<3>()) - Vector3d(0, 0.05, 0)).norm());
      }
    }
    EXPECT_LT(controller.error_m(), 2e-3) << ToString(objective);
    EXPECT_LT(controller.error_rad(), 5e-3) << ToString(objective);
    if (objective == Objective::kPosition) {
      EXPECT_LT(fastest, 0.13);
    }
    EXPECT_EQ(arm.Exceeded(), "");
  }
}

TEST(ConstrainedTorque, WhatIsNotFiniteBrakesTheArm) {
  TorqueArm arm;
  std::vector<Solid> solids = {{"wall", geometry::Primitive(geometry::Box{{0.04, 1.0, 1.0}}), false}};
  std::vector<MovingPose> poses = {{Pose(Vector3d(0.8, 0, 0.5))}};
  ConstrainedTorque controller(arm.model, Pose(), solids, {KeepClear(*arm.model, {0})}, {}, {});
  HandTarget target;
  target.X_BH = arm.state.X_BH();
  target.X_BH.p.y() += 0.3;
  for (int i = 0; i < 3000; ++i) {
    HandTarget now = target;
    const bool bad = i > 150;
    std::vector<MovingPose> seen = poses;
    if (bad && i < 1000) now.X_BH.p.x() = std::nan("");
    if (bad && i >= 1000) seen[0].X.p.x() = std::nan("");
    arm.Step(controller.Compute({arm.state, 0.04, seen}, {&now, nullptr, &arm.model->home()}));
    ASSERT_EQ(controller.flags().fault, bad);
  }
  EXPECT_LT(arm.v.norm(), 0.01);
  EXPECT_EQ(arm.Exceeded(), "");
}

// With so few iterations nothing can be solved: the arm brakes, and is within all limits of torque and rate.
TEST(ConstrainedTorque, TheBoundOnIterationsIsKeptAndTheArmBrakes) {
  TorqueArm arm;
  TorqueOptions options;
  options.max_iterations = 1;
  options.max_solves = 1;
  ConstrainedTorque controller(arm.model, Pose(), {}, {}, {}, options);
  HandTarget target;
  target.X_BH = arm.state.X_BH();
  target.X_BH.p.y() += 0.6;
  int braking = 0;
  for (int i = 0; i < 3000; ++i) {
    arm.Step(controller.Compute({arm.state, 0.04, {}}, {&target, nullptr, &arm.model->home(), 500}));
    EXPECT_LE(controller.flags().iterations, 4);
    braking += controller.flags().braking ? 1 : 0;
  }
  EXPECT_GT(braking, 0);
  EXPECT_EQ(arm.Exceeded(), "");
}

// A force of 15 N on the hand from the wall it stands at: within 10 ms the command yields, and the arm moves
// away from the wall.
TEST(ConstrainedTorque, YieldsToAContactThatNoStepIntends) {
  TorqueArm arm;
  std::vector<Solid> solids = {{"wall", geometry::Primitive(geometry::Box{{0.04, 1.0, 1.0}}), false},
                               {"shelf", geometry::Primitive(geometry::Box{{0.1, 0.1, 0.1}}), false}};
  std::vector<MovingPose> poses = {{Pose(Vector3d(0.57, 0, 0.5))}, {Pose(Vector3d(0.4, 0.6, 0.1))}};
  ConstrainedTorque controller(arm.model, Pose(), solids, {KeepClear(*arm.model, {0, 1}, 0)}, {}, {});
  HandTarget target;
  target.X_BH = arm.state.X_BH();
  target.X_BH.p.x() = 0.8;
  VectorXd external = VectorXd::Zero(7);
  for (int i = 0; i < 2500; ++i) {
    arm.Step(controller.Compute({arm.state, 0.04, poses, &external}, {&target, nullptr, &arm.model->home()}));
    ASSERT_FALSE(controller.flags().yielding);
  }
  const double before = arm.state.X_BH().p.x();
  int began = -1;
  for (int i = 0; i < 150; ++i) {
    external = arm.state.J_BH().topRows<3>().transpose() * Vector3d(-15, 0, 0);
    arm.Step(controller.Compute({arm.state, 0.04, poses, &external}, {&target, nullptr, &arm.model->home()}),
             external);
    if (controller.contact().began) {
      began = i;
      EXPECT_EQ(controller.bodies().name(controller.contact().b), "wall");
      EXPECT_NEAR(controller.contact().force, 12, 4);
    }
  }
  EXPECT_GE(began, 0);
  EXPECT_LE(began, 10);
  EXPECT_LT(arm.state.X_BH().p.x(), before - 0.002);
  external.setZero();
  for (int i = 0; i < 500; ++i) {
    arm.Step(controller.Compute({arm.state, 0.04, poses, &external}, {&target, nullptr, &arm.model->home()}));
  }
  EXPECT_FALSE(controller.flags().yielding);
}

// Blocked by something that nobody sees, the servo presses with no more than it may.
TEST(ConstrainedTorque, TheServoForceIsBounded) {
  for (const double most : {20.0, 40.0}) {
    TorqueArm arm;
    ConstrainedTorque controller(arm.model, Pose(), {}, {}, {}, {});
    HandTarget target;
    target.X_BH = arm.state.X_BH();
    target.X_BH.p.x() += 0.3;
    VectorXd torque;
    // The arm is held where it is.
    for (int i = 0; i < 1000; ++i) {
      torque = controller.Compute({arm.state, 0.04, {}}, {&target, nullptr, nullptr, most});
    }
    EXPECT_TRUE(controller.flags().force_limit);
    const VectorXd pressing = torque - arm.state.bias();
    const math::Vector6d force = arm.state.J_BH().transpose().colPivHouseholderQr().solve(pressing);
    EXPECT_LT(force.head<3>().norm(), 1.02 * most);
    EXPECT_GT(force.head<3>().norm(), 0.6 * most);
  }
}

TEST(ConstrainedTorque, OptionsThatMakeNoSenseAreRefused) {
  TorqueOptions options;
  options.period = 0;
  options.velocity_share = 1.5;
  options.field_rate = std::nan("");
  try {
    options.Validate();
    FAIL();
  } catch (const InputError& error) {
    const std::string text = error.what();
    for (const char* part :
         {"'period' of the torque controller", "'velocity_share'", "'field_rate'", "at most 1"}) {
      EXPECT_NE(text.find(part), std::string::npos) << text;
    }
  }
}

}  // namespace
}  // namespace tether::control
