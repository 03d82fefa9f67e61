#include "tether/control/torque/constrained_torque.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "testing/control/torque_arm.h"
#include "tether/common/error.h"
#include "tether/common/random.h"
#include "tether/constraints/core/field_function.h"
#include "tether/control/objective.h"
#include "tether/geometry/distance/distance.h"

namespace tether::control {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using math::Pose;

ClearanceConstraint KeepClear(const robot::Model& model, std::vector<int> to, double distance = 0.01,
                              Priority priority = 0) {
  ClearanceConstraint clearance{"clearance", {}, true, std::move(to), distance, priority};
  for (int body = 0; body <= model.solids().hand(); ++body) clearance.of.push_back(body);
  return clearance;
}

/// Distances of the arm's bodies from an object, judged without the controller's rows.
double LeastDistance(const ArmBodies& bodies, int object) {
  double least = 1e9;
  const int b = bodies.object(object);
  for (int a = 0; a <= bodies.hand(); ++a) {
    if (bodies.link(a) == 0) continue;
    for (const auto* p = bodies.begin(a); p != bodies.end(a); ++p) {
      for (const auto* r = bodies.begin(b); r != bodies.end(b); ++r) {
        least = std::min(least,
                         geometry::SignedDistance(p->primitive, p->X_BP, r->primitive, r->X_BP).distance);
      }
    }
  }
  return least;
}

TEST(ConstrainedTorque, ConvergesToAPoseWithinAllLimits) {
  Random random(1);
  for (int trial = 0; trial < 5; ++trial) {
    TorqueArm arm;
    ConstrainedTorque controller(arm.model, Pose(), {}, {}, {}, {});
    HandTarget target;
    target.X_BH = arm.state.X_BH();
    target.X_BH.p += Vector3d(random.Uniform(-0.1, 0.2), random.Uniform(-0.2, 0.2), random.Uniform(-0.2, 0.2));
    target.X_BH.R =
        math::ExpSO3(Vector3d(random.Uniform(-0.2, 0.2), random.Uniform(-0.2, 0.2), random.Uniform(-1, 1))) *
        target.X_BH.R;
    for (int i = 0; i < 4000; ++i) {
      arm.Step(controller.Compute({arm.state, 0.04, {}}, {&target, nullptr, &arm.model->home()}));
      ASSERT_FALSE(controller.flags().fault || controller.flags().braking || controller.flags().relaxed)
          << i << controller.flags().relaxed << controller.flags().worst << " " << controller.flags().violation;
    }
    EXPECT_LT((arm.state.X_BH().p - target.X_BH.p).norm(), 1e-3);
    EXPECT_LT(math::AngleBetween(arm.state.X_BH().R, target.X_BH.R), 4e-3);
    arm.ExpectWithinLimits();
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
  arm.ExpectWithinLimits();
  RecordProperty("error_ratio", std::to_string(now.error / before.error));
  RecordProperty("work_ratio", std::to_string(now.work / before.work));
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
        target.X_BH.R = math::ExpSO3(
            Vector3d(random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(-3, 3)));
        for (int j = 0; j < 7; ++j) posture[j] = random.Uniform(-4, 4);
      }
      arm.Step(controller.Compute({arm.state, 0.04, {}}, {&target, nullptr, &posture, 200}));
      braking += controller.flags().braking ? 1 : 0;
      ASSERT_FALSE(controller.flags().fault);
    }
    arm.ExpectWithinLimits();
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
      const VectorXd& torque = controller.Compute({arm.state, 0.04, {}}, {&target, nullptr, &arm.model->home()});
      at_limit += controller.flags().torque_limit ? 1 : 0;
      arm.Step(torque, -arm.state.J_BH().transpose() * target.F_BH);
    }
    EXPECT_GT(at_limit, 0);
    EXPECT_GE(arm.torque_room, 0);
    EXPECT_GE(arm.rate_room, 0);
  }
}

/// A scene with every kind of row: links, hand, held object, the arm itself; tilt, axis, cone.
struct RowScene {
  std::vector<Solid> solids;
  std::vector<MovingPose> poses;
  std::vector<ClearanceConstraint> clearances;
  std::vector<FieldConstraint> fields;

  explicit RowScene(const robot::Model& model) {
    const auto add = [&](const char* name, const geometry::Primitive& primitive, const Vector3d& p) {
      solids.push_back({name, primitive, true});
      // Nothing is parallel: there distances have kinks.
      poses.push_back({Pose(math::ExpSO3(Vector3d(0.02, 0.03, 0.01)), p)});
    };
    add("table", geometry::Box{{1.4, 1.8, 0.04}}, {0, 0, -0.02});
    add("post", geometry::Cylinder{0.05, 0.4}, {0.35, 0.3, 0.2});
    add("held", geometry::Box{{0.05, 0.05, 0.1}}, {0.3, 0, 0.3});
    add("ball", geometry::Sphere{0.06}, {0.3, -0.3, 0.5});
    clearances = {KeepClear(model, {0, 1, 2, 3})};
    fields = {{"tilt", constraints::MakeAngle(Vector3d::UnitZ(), -Vector3d::UnitZ(), 0.35), {}, {}, 1},
              {"axis",
               constraints::MakeAxisDistance(Vector3d::Zero(), Vector3d::UnitZ(), Vector3d::Zero(), 0.15, -1),
               {},
               {}},
              {"cone",
               constraints::MakePointCone(0.05, {0.2, 0.2, 0.3}, Vector3d(0, 0, 0.01)),
               {1, Pose(Vector3d(0, 0, 0.2))},
               {2, Pose(Vector3d(0.01, 0, 0))}}};
  }

  /// Everything `t` later: the arm accelerates with `a`, objects move on.
  std::vector<MovingPose> After(double t, const Pose& X_WH, const Pose& X_HO, int held) const {
    std::vector<MovingPose> later = poses;
    for (size_t i = 0; i < later.size(); ++i) {
      later[i].X.p += t * poses[i].V.head<3>();
      later[i].X.R = math::ExpSO3(Vector3d(t * poses[i].V.tail<3>())) * poses[i].X.R;
    }
    later[static_cast<size_t>(held)].X = X_WH * X_HO;
    return later;
  }
};

// Each row's value, its rate, and its second derivative J q̈ + J̇ q̇, against numeric differentiation along the
// motion, with obstacles that move and turn.
TEST(ConstrainedTorque, TheSecondDerivativeOfEveryRowIsExact) {
  const auto model = robot::Model::Load("panda");
  RowScene scene(*model);
  TorqueOptions options;
  options.range = 0.4;
  ConstrainedTorque controller(model, Pose(), scene.solids, scene.clearances, scene.fields, options);
  controller.Hold(2);
  Random random(4);
  robot::State state(model);
  int looked_at = 0, of_fields = 0;
  for (int trial = 0; trial < 150; ++trial) {
    VectorXd q = model->home(), v(7), a(7);
    for (int i = 0; i < 7; ++i) {
      q[i] += random.Uniform(-0.3, 0.3);
      v[i] = random.Uniform(-1, 1);
      a[i] = random.Uniform(-3, 3);
    }
    for (MovingPose& pose : scene.poses) {
      for (int i = 0; i < 6; ++i) pose.V[i] = random.Uniform(-0.5, 0.5);
    }
    const Pose X_HO(math::ExpSO3(Vector3d(0.1, 0.2, 0.3)), Vector3d(0, 0, 0.03));
    using Rows = std::vector<std::pair<ConstrainedTorque::Row, Eigen::RowVectorXd>>;
    const auto rows_at = [&](double t) {
      state.Set(q + t * v + 0.5 * t * t * a, v + t * a);
      const std::vector<MovingPose> poses = scene.After(t, state.X_BH(), X_HO, 2);
      controller.Restart();
      controller.Compute({state, 0.04, poses}, {});
      Rows rows;
      for (int i = 0; i < controller.num_rows(); ++i) {
        rows.emplace_back(controller.row(i), controller.row_jacobian(i));
      }
      return rows;
    };
    const double h = 1e-5;
    const Rows now = rows_at(0), after = rows_at(h), before = rows_at(-h);
    ASSERT_EQ(now.size(), after.size());
    ASSERT_EQ(now.size(), before.size());
    for (size_t i = 0; i < now.size(); ++i) {
      const ConstrainedTorque::Row& row = now[i].first;
      const double forward = (after[i].first.rate - row.rate) / h;
      const double backward = (row.rate - before[i].first.rate) / h;
      // The nearest feature changes here.
      if (std::abs(forward - backward) > 1e-2 * (1 + std::abs(forward))) continue;
      const double rate = (after[i].first.value - before[i].first.value) / (2 * h);
      EXPECT_NEAR(row.rate, rate, 1e-5 * (1 + std::abs(rate)));
      const double acceleration = now[i].second.dot(a) + row.bias;
      if (std::abs(forward) > 15) continue;
      EXPECT_NEAR(acceleration, 0.5 * (forward + backward), 5e-3 * (1 + std::abs(forward)))
          << controller.constraint_name(row.constraint) << " " << row.a << " " << row.b;
      ++looked_at;
      of_fields += row.a < 0 ? 1 : 0;
    }
  }
  EXPECT_GT(looked_at, 800);
  EXPECT_GT(of_fields, 300);
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
      nearest = std::min({nearest, LeastDistance(controller.bodies(), 0), LeastDistance(controller.bodies(), 1)});
      ASSERT_FALSE(controller.flags().fault || controller.flags().braking) << i;
    }
    EXPECT_GT(nearest, 0.01 - 0.0005) << moving;
    EXPECT_LT(nearest, 0.02);
    arm.ExpectWithinLimits();
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
  VectorXd last_sign = VectorXd::Zero(7);
  std::vector<int> last_time(7, -1000000);
  int changes = 0;
  for (int i = 0; i < 12000; ++i) {
    arm.Step(controller.Compute({arm.state, 0.04, poses}, {&target, nullptr, &arm.model->home()}));
    for (int j = 0; i > 2000 && j < 7; ++j) {
      if (std::abs(arm.v[j]) < 0.01) continue;
      const double sign = arm.v[j] > 0 ? 1 : -1;
      if (sign == -last_sign[j] && i - last_time[static_cast<size_t>(j)] < 100) ++changes;
      last_sign[j] = sign;
      last_time[static_cast<size_t>(j)] = i;
    }
  }
  EXPECT_EQ(changes, 0);
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
  arm.ExpectWithinLimits();
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
    arm.ExpectWithinLimits();
  }
}

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
  arm.ExpectWithinLimits(false);
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
    arm.ExpectWithinLimits(false);
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
  arm.ExpectWithinLimits();
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
  arm.ExpectWithinLimits();
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
    for (const char* part : {"'period' of the torque controller", "'velocity_share'", "'field_rate'", "at most 1"}) {
      EXPECT_NE(text.find(part), std::string::npos) << text;
    }
  }
}

}  // namespace
}  // namespace tether::control
