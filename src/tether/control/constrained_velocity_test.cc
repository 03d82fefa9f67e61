#include "tether/control/constrained_velocity.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/common/error.h"
#include "tether/common/random.h"
#include "tether/constraints/core/field_function.h"
#include "tether/control/objective.h"
#include "tether/math/numeric_derivative.h"

namespace tether::control {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using math::Pose;

/// An arm beside a table, a wall and a post, with every kind of row.
struct Bench {
  std::shared_ptr<const robot::Model> model;
  std::vector<Solid> objects;
  std::vector<MovingPose> poses;
  Pose X_WBase;
  VelocityOptions options;
  std::vector<ClearanceConstraint> clearances;
  std::vector<FieldConstraint> fields;

  explicit Bench(const std::string& name) : model(robot::Model::Load(name)) {
    X_WBase = Pose(math::RotationFromRpy({0, 0, 0.3}), {0.05, -0.1, 0});
    const auto add = [&](const std::string& object, const geometry::Primitive& shape, bool movable,
                         const Pose& X_WO) {
      objects.push_back({object, shape, movable});
      poses.push_back({X_WO});
    };
    add("table", geometry::Box{{1.4, 1.8, 0.04}}, false, Pose(Vector3d(0, 0, -0.02)));
    add("wall", geometry::Box{{0.04, 1.8, 1.2}}, false, Pose(Vector3d(0.75, 0, 0.6)));
    add("post", geometry::Cylinder{0.05, 0.4}, true, Pose(Vector3d(0.3, 0.4, 0.2)));
    add("ball", geometry::Sphere{0.06}, true, Pose(Vector3d(0.2, -0.4, 0.5)));
  }

  std::vector<int> AllLinks() const {
    std::vector<int> bodies;
    for (int i = 0; i <= model->solids().hand(); ++i) bodies.push_back(i);
    return bodies;
  }

  ConstrainedVelocity Make() const { return {model, X_WBase, objects, clearances, fields, options}; }

  const VectorXd& Compute(ConstrainedVelocity& controller, const VectorXd& q,
                          const Goal* goal = nullptr) const {
    return controller.Compute({q, 0.5 * model->gripper().max_opening, poses}, goal);
  }

  /// The hand at X_WH.
  Goal HandAt(const Pose& X_WH, Objective objective = Objective::kPose) const {
    Goal goal;
    goal.functions = MakeObjective(objective, X_WBase.Inverse() * X_WH);
    return goal;
  }

  Pose X_WH(const VectorXd& q) const {
    robot::Kinematics kinematics(model);
    kinematics.Set(q);
    return X_WBase * kinematics.X_BH();
  }
};

class ConstrainedVelocityTest : public ::testing::TestWithParam<std::string> {};

VectorXd RandomConfiguration(const robot::Model& model, Random& random) {
  VectorXd q(model.dof());
  for (int i = 0; i < model.dof(); ++i) q[i] = random.Uniform(model.lower()[i], model.upper()[i]);
  return q;
}

void AddEveryField(Bench& bench, Random& random) {
  const auto vector = [&] { return Vector3d(random.Normal(), random.Normal(), random.Normal()); };
  const auto unit = [&] { return vector().normalized(); };
  const auto pose = [&] { return Pose(math::ExpSO3(vector()), 0.3 * vector()); };
  const std::vector<std::pair<std::string, constraints::PoseFunctionPtr>> functions = {
      {"point-point", constraints::MakePointDistance(vector(), 0.1 * vector(), 0.1, -1)},
      {"point-line", constraints::MakeAxisDistance(vector(), unit(), 0.1 * vector(), 0.1)},
      {"point-plane", constraints::MakeHalfSpaces({{0.1 * vector(), unit(), 0.2}})},
      {"line-line", constraints::MakeLineDistance({vector(), unit()}, {0.1 * vector(), unit()}, 0.1, -1)},
      {"line-plane", constraints::MakeDirections({{unit(), unit(), 0.2}})},
      {"line-cone", constraints::MakeAngle(unit(), unit(), 0.35)},
      {"narrowing cone", constraints::MakeNarrowingAngle(unit(), unit(), 0.1, 0.7, 0.1 * vector())},
      {"point-cone", constraints::MakePointCone(0.06, {0.3, 0.2, 0.4}, 0.1 * vector())},
      {"frustum", constraints::MakeFrustum({0.1, 0.2}, {0.3, 0.2, 0.4}, 0.1 * vector())},
      {"capped cylinder", constraints::MakePartDistance({geometry::Cylinder{0.1, 0.3}, pose()},
                                                        {geometry::Sphere{0}, pose()}, 0.05, -1)},
  };
  int target = 0;
  for (const auto& [name, function] : functions) {
    bench.fields.push_back({name, function, {(target++ % 3) - 1, pose()}, {-1, Pose(0.1 * vector())}});
  }
}

TEST_P(ConstrainedVelocityTest, EveryRowHasTheExactDerivative) {
  Random random(11);
  Bench bench(GetParam());
  AddEveryField(bench, random);
  bench.clearances = {{"clearance", bench.AllLinks(), true, {0, 1, 2, 3}, 0.01, 0}};
  bench.options.range = 20;
  ConstrainedVelocity controller = bench.Make();
  controller.Hold(3);
  const int n = bench.model->dof();
  const Pose X_HO(Vector3d(0.01, 0.02, 0.03));
  const auto values = [&](const VectorXd& q) {
    bench.poses[3].X = bench.X_WH(q) * X_HO;
    bench.Compute(controller, q);
    VectorXd all(controller.num_rows());
    for (int i = 0; i < all.size(); ++i) all[i] = controller.row(i).value;
    return all;
  };
  int compared = 0, ties = 0;
  for (int state = 0; state < 1000; ++state) {
    const VectorXd q = RandomConfiguration(*bench.model, random);
    const VectorXd v = VectorXd::NullaryExpr(n, [&] { return random.Normal(); }).normalized();
    // Central differences along a random direction, at two steps: where they disagree there is a kink.
    const auto slope = [&](double h) -> VectorXd {
      return (values(q + h * v) - values(q - h * v)) / (2 * h);
    };
    const VectorXd coarse = slope(1e-4), fine = slope(5e-5);
    values(q);
    ASSERT_EQ(controller.num_rows(), fine.size());
    for (int i = 0; i < fine.size(); ++i) {
      if (std::abs(coarse[i] - fine[i]) > 2e-6) {
        ++ties;
        continue;
      }
      ++compared;
      EXPECT_NEAR(controller.row_jacobian(i).dot(v), (4 * fine[i] - coarse[i]) / 3, 1e-5)
          << controller.constraint_name(controller.row(i).constraint) << " in state " << state;
    }
  }
  EXPECT_LT(ties, compared / 50);
}

TEST_P(ConstrainedVelocityTest, RowsKnowHowMovingThingsChangeThem) {
  Random random(12);
  Bench bench(GetParam());
  AddEveryField(bench, random);
  bench.clearances = {{"clearance", bench.AllLinks(), false, {0, 1, 2, 3}, 0.01, 0}};
  bench.options.range = 20;
  ConstrainedVelocity controller = bench.Make();
  const auto at_rest = bench.poses;
  for (int state = 0; state < 100; ++state) {
    const VectorXd q = RandomConfiguration(*bench.model, random);
    for (MovingPose& pose : bench.poses)
      pose.V = math::Vector6d::NullaryExpr([&] { return random.Normal(); });
    const auto values = [&](double t) {
      for (size_t k = 0; k < bench.poses.size(); ++k) {
        const math::Vector6d& V = bench.poses[k].V;
        bench.poses[k].X.p = at_rest[k].X.p + t * V.head<3>();
        bench.poses[k].X.R = math::ExpSO3(t * V.tail<3>()) * at_rest[k].X.R;
      }
      bench.Compute(controller, q);
      VectorXd all(controller.num_rows());
      for (int i = 0; i < all.size(); ++i) all[i] = controller.row(i).value;
      return all;
    };
    const VectorXd coarse = (values(2e-5) - values(-2e-5)) / 4e-5;
    const VectorXd fine = (values(1e-5) - values(-1e-5)) / 2e-5;
    values(0);
    for (int i = 0; i < fine.size(); ++i) {
      if (std::abs(coarse[i] - fine[i]) > 1e-5) continue;
      EXPECT_NEAR(controller.row(i).drift, fine[i], 1e-4)
          << controller.constraint_name(controller.row(i).constraint);
    }
  }
}

/// Follows the velocities exactly for `seconds`; `each` is called after every tick.
void Follow(
    const Bench& bench, ConstrainedVelocity& controller, const Goal& goal, VectorXd& q, double seconds,
    const std::function<void()>& each = [] {}) {
  const double period = 0.005;
  for (int tick = 0; tick * period < seconds; ++tick) {
    q += period * bench.Compute(controller, q, &goal);
    each();
  }
}

TEST_P(ConstrainedVelocityTest, ErrorsDecayAtTheGain) {
  Bench bench(GetParam());
  ConstrainedVelocity controller = bench.Make();
  VectorXd q = bench.model->home();
  const Pose X_WH = bench.X_WH(q) * Pose(math::ExpSO3({0.05, -0.05, 0.1}), {0.02, 0.03, -0.04});
  for (const std::string& name : ObjectiveNames()) {
    q = bench.model->home();
    const Goal goal = bench.HandAt(X_WH, *FindObjective(name));
    bench.Compute(controller, q, &goal);
    const double start_m = controller.error_m(), start_rad = controller.error_rad();
    Follow(bench, controller, goal, q, 2.0);
    bench.Compute(controller, q, &goal);
    EXPECT_NEAR(controller.error_m(), start_m * std::exp(-2.0), 0.05 * start_m) << name;
    EXPECT_NEAR(controller.error_rad(), start_rad * std::exp(-2.0), 0.05 * start_rad) << name;
  }
}

TEST_P(ConstrainedVelocityTest, AMovingTargetIsFollowedWithoutLag) {
  Bench bench(GetParam());
  bench.options.damping = 1e-6;  // damping is what lags,
  bench.options.ramp = 0;        // and at the start what bounds changes
  ConstrainedVelocity controller = bench.Make();
  VectorXd q = bench.model->home();
  Goal goal;
  goal.target.object = 2;
  goal.functions = MakeObjective(Objective::kPose, math::Between(bench.poses[2].X, bench.X_WH(q)));
  bench.poses[2].V << 0.01, -0.02, 0.015, 0, 0, 0.02;
  for (int tick = 0; tick < 400; ++tick) {
    q += 0.005 * bench.Compute(controller, q, &goal);
    bench.poses[2].X.p += 0.005 * bench.poses[2].V.head<3>();
    bench.poses[2].X.R = math::ExpSO3(0.005 * bench.poses[2].V.tail<3>()) * bench.poses[2].X.R;
    EXPECT_LT(controller.error_m(), 5e-4);
    EXPECT_LT(controller.error_rad(), 5e-4);
  }
}

TEST_P(ConstrainedVelocityTest, NeitherTheArmNorWhatItHoldsComesNearerThanTheSafeDistance) {
  Random random(13);
  Bench bench(GetParam());
  bench.clearances = {{"clearance", bench.AllLinks(), true, {0, 1, 2, 3}, 0.01, 0}};
  bench.options.gain = 5;
  ConstrainedVelocity controller = bench.Make();
  controller.Hold(3);
  const Pose X_HO(Vector3d(0, 0, 0.05));
  for (int trial = 0; trial < 10; ++trial) {
    VectorXd q = bench.model->home();
    // Straight into the table, the wall, the post, or the arm itself.
    const Pose X_WH(
        math::ExpSO3(Vector3d(random.Normal(), random.Normal(), random.Normal())) *
            math::RotationFromRpy({M_PI, 0, 0}),
        Vector3d(random.Uniform(-0.3, 0.8), random.Uniform(-0.6, 0.6), random.Uniform(-0.2, 0.5)));
    const Goal goal = bench.HandAt(X_WH);
    bench.poses[3].X = bench.X_WH(q) * X_HO;
    Follow(bench, controller, goal, q, 4.0, [&] {
      bench.poses[3].X = bench.X_WH(q) * X_HO;
      for (int i = 0; i < controller.num_rows(); ++i) {
        ASSERT_GT(controller.row(i).value, -5e-4)
            << controller.constraint_name(controller.row(i).constraint) << " in trial " << trial;
      }
      ASSERT_FALSE(controller.flags().fault);
      for (int i = 0; i < q.size(); ++i) {
        ASSERT_GE(q[i], bench.model->lower()[i] - 1e-9);
        ASSERT_LE(q[i], bench.model->upper()[i] + 1e-9);
      }
    });
  }
}

TEST_P(ConstrainedVelocityTest, AThingThatComesNearPushesTheArmAway) {
  Bench bench(GetParam());
  bench.clearances = {{"clearance", bench.AllLinks(), false, {3}, 0.03, 0}};
  ConstrainedVelocity controller = bench.Make();
  VectorXd q = bench.model->home();
  const Vector3d p_WH = bench.X_WH(q).p;
  bench.poses[3].X.p = p_WH + Vector3d(0, -0.35, 0.05);
  bench.poses[3].V << 0, 0.1, 0, 0, 0, 0;
  for (int tick = 0; tick < 800; ++tick) {
    q += 0.005 * bench.Compute(controller, q);
    bench.poses[3].X.p += 0.005 * bench.poses[3].V.head<3>();
    for (int i = 0; i < controller.num_rows(); ++i) EXPECT_GT(controller.row(i).value, -5e-4);
  }
  EXPECT_GT((bench.X_WH(q).p - p_WH).norm(), 0.1);
}

TEST_P(ConstrainedVelocityTest, WhatStartsInAForbiddenZoneLeavesItAtABoundedSpeed) {
  Bench bench(GetParam());
  const VectorXd home = bench.model->home();
  VectorXd q = home;
  const double height = bench.X_WH(q).p.z();
  // A floor for the hand that is 8 cm above it.
  bench.fields = {{"floor",
                   constraints::MakeHalfSpaces({{Vector3d::Zero(), -Vector3d::UnitZ(), -(height + 0.08)}}),
                   {},
                   {}}};
  ConstrainedVelocity controller = bench.Make();
  double last = height;
  for (int tick = 0; tick < 800; ++tick) {
    q += 0.005 * bench.Compute(controller, q);
    if (tick == 0) {
      EXPECT_TRUE(controller.flags().escaping);
      EXPECT_EQ(controller.constraint_name(controller.flags().worst), "floor");
      EXPECT_NEAR(controller.flags().violation, 0.08 + bench.options.buffer, 1e-9);
    }
    const double now = bench.X_WH(q).p.z();
    EXPECT_LT(now - last, 1.05 * 0.005 * bench.options.escape_speed);
    last = now;
  }
  EXPECT_GT(last, height + 0.08);
  EXPECT_FALSE(controller.flags().escaping);
}

TEST_P(ConstrainedVelocityTest, WhereRowsConflictTheLowerPriorityIsRelaxed) {
  for (const bool upper_matters : {true, false}) {
    Bench bench(GetParam());
    VectorXd q = bench.model->home();
    const double height = bench.X_WH(q).p.z();
    const auto plane = [&](double sign, double offset) {
      return constraints::MakeHalfSpaces({{Vector3d::Zero(), sign * Vector3d::UnitZ(), sign * offset}});
    };
    // The hand shall be 5 cm higher and 5 cm lower than it is.
    bench.fields = {{"higher", plane(-1, height + 0.05), {}, {}, upper_matters ? 0 : 2},
                    {"lower", plane(1, height - 0.05), {}, {}, 1}};
    ConstrainedVelocity controller = bench.Make();
    q += 0.005 * bench.Compute(controller, q);
    EXPECT_TRUE(controller.flags().relaxed);
    EXPECT_EQ(controller.constraint_name(controller.flags().worst), upper_matters ? "lower" : "higher");
    for (int tick = 0; tick < 800; ++tick) q += 0.005 * bench.Compute(controller, q);
    EXPECT_NEAR(bench.X_WH(q).p.z(), height + (upper_matters ? 0.05 : -0.05), 0.004);
  }
}

// ERRATA B2: also where both limits of a joint have one sign.
TEST_P(ConstrainedVelocityTest, JointsKeepTheirMarginAndComeBackIntoTheirRange) {
  Bench bench(GetParam());
  bench.options.joint_margin = 0.05;
  bench.options.gain = 5;
  Random random(14);
  ConstrainedVelocity controller = bench.Make();
  const robot::Model& model = *bench.model;
  for (int trial = 0; trial < 20; ++trial) {
    VectorXd q = model.home();
    const Goal goal = bench.HandAt(bench.X_WH(RandomConfiguration(model, random)));
    Follow(bench, controller, goal, q, 3.0, [&] {
      for (int i = 0; i < q.size(); ++i) {
        ASSERT_GE(q[i], model.lower()[i] + 0.05 - 1e-9);
        ASSERT_LE(q[i], model.upper()[i] - 0.05 + 1e-9);
      }
    });
  }
  for (int joint = 0; joint < model.dof(); ++joint) {
    VectorXd q = model.home();
    q[joint] = model.upper()[joint] + 0.1;
    ConstrainedVelocity at_rest = bench.Make();
    const VectorXd v = bench.Compute(at_rest, q);
    EXPECT_LT(v[joint], 0);
    EXPECT_GE(v[joint], -bench.options.escape_speed - 1e-12);
  }
}

TEST_P(ConstrainedVelocityTest, VelocitiesChangeGraduallyUnlessADistanceNeedsIt) {
  Random random(15);
  Bench bench(GetParam());
  bench.options.gain = 20;
  bench.clearances = {{"clearance", bench.AllLinks(), false, {3}, 0.03, 0}};
  const VectorXd& most = bench.model->max_velocity();
  const VectorXd change = most * bench.options.period / bench.options.ramp;
  ConstrainedVelocity controller = bench.Make();
  VectorXd q = bench.model->home(), before = VectorXd::Zero(q.size());
  double fastest = 0;
  bench.poses[3].X.p = {0, 0, 5};  // nothing is near
  for (int tick = 0; tick < 2000; ++tick) {
    Goal goal;
    if (tick % 100 == 0) goal.posture = RandomConfiguration(*bench.model, random);
    goal.turn_speed = 10;
    const VectorXd v = bench.Compute(controller, q, tick % 300 < 200 ? &goal : nullptr);
    ASSERT_LE(((v - before).cwiseAbs() - change).maxCoeff(), 1e-12);
    fastest = std::max(fastest, (v.cwiseAbs().array() / most.array()).maxCoeff());
    before = v;
    q += bench.options.period * v;
  }
  EXPECT_LE(fastest, bench.options.velocity_share + 1e-12);

  // A ball that appears beside the hand at rest and comes at it: the arm is as fast as it has to be.
  q = bench.model->home();
  controller = bench.Make();
  bench.poses[3].X.p = bench.X_WH(q).p + Vector3d(0, -0.3, 0);
  const auto nearest = [&] {
    double value = 1;
    for (int i = 0; i < controller.num_rows(); ++i) {
      if (controller.row(i).a >= 0 && controller.row(i).b == controller.bodies().object(3))
        value = std::min(value, controller.row(i).value);
    }
    return value;
  };
  for (int k = 0; k < 50; ++k) {
    bench.Compute(controller, q);
    bench.poses[3].X.p.y() += std::min(0.02, 0.5 * (nearest() - 5e-4));
  }
  ASSERT_NEAR(nearest(), 5e-4, 1e-4);
  bench.poses[3].V << 0, 0.15, 0, 0, 0, 0;
  const VectorXd v = bench.Compute(controller, q);
  EXPECT_GT((v.cwiseAbs() - change).maxCoeff(), 0.02);
  EXPECT_FALSE(controller.flags().relaxed);
  for (int i = 0; i < controller.num_rows(); ++i) {
    const ConstrainedVelocity::Row& row = controller.row(i);
    EXPECT_GE(controller.row_jacobian(i).dot(v) + row.drift,
              std::min(-bench.options.field_gain * row.value, bench.options.escape_speed) - 1e-9);
  }
}

TEST_P(ConstrainedVelocityTest, StopsWhenASensorGivesNoNumber) {
  Bench bench(GetParam());
  ConstrainedVelocity controller = bench.Make();
  VectorXd q = bench.model->home();
  const Goal goal = bench.HandAt(Pose(Vector3d(0.4, 0.1, 0.2)));
  EXPECT_GT(bench.Compute(controller, q, &goal).norm(), 0.01);
  for (int i = 0; i < 20; ++i) bench.Compute(controller, q, &goal);
  VectorXd broken = q, last = bench.Compute(controller, q, &goal);
  broken[1] = std::numeric_limits<double>::quiet_NaN();
  // On a ramp: a servo that is asked to stand at once overshoots.
  const VectorXd most = bench.options.period * bench.model->max_acceleration();
  for (int i = 0; i < 60; ++i) {
    const VectorXd now = bench.Compute(controller, broken, &goal);
    EXPECT_TRUE(controller.flags().fault);
    EXPECT_TRUE(((now - last).cwiseAbs().array() <= most.array() + 1e-12).all());
    EXPECT_TRUE((now.cwiseAbs().array() <= last.cwiseAbs().array()).all());
    last = now;
  }
  EXPECT_EQ(last.norm(), 0);
  const Pose X_WTable = bench.poses[0].X;
  bench.poses[0].X.p.x() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(bench.Compute(controller, q, &goal).norm(), 0);
  bench.poses[0].X = X_WTable;
  EXPECT_GT(bench.Compute(controller, q, &goal).norm(), 0.01);
  EXPECT_FALSE(controller.flags().fault);
}

TEST(VelocityOptionsTest, NamesEverythingThatIsNotValid) {
  VelocityOptions options;
  options.gain = -1;
  options.damping = 0;
  options.range = std::numeric_limits<double>::quiet_NaN();
  try {
    options.Validate();
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(),
                ::testing::AllOf(::testing::HasSubstr("'gain' of the velocity controller is -1"),
                                 ::testing::HasSubstr("'damping'"), ::testing::HasSubstr("'range'"),
                                 ::testing::HasSubstr("above zero is accepted")));
  }
}

// cups_seed3_undisturbed: what a goal leaves free drifted until the elbow was folded.
TEST(ConstrainedVelocityPosture, LeavesTheLimitsWhereTheGoalLeavesItFree) {
  Bench bench("panda");
  ConstrainedVelocity controller = bench.Make();
  VectorXd q = bench.model->home();
  q[3] = -3.0;  // folded
  const Pose X_WHand = bench.X_WH(q);
  Goal goal = bench.HandAt(Pose(X_WHand.R, X_WHand.p + Vector3d(0, 0.15, 0)), Objective::kPosition);
  const double folded = q[3];
  for (int tick = 0; tick < 1600; ++tick) q += bench.options.period * bench.Compute(controller, q, &goal);
  EXPECT_LT(controller.error_m(), 2e-3) << "the goal is reached all the same";
  EXPECT_GT(q[3], folded + 0.1);
  // Without the term, or within the middle of the range, nothing but the goal moves a joint.
  bench.options.posture_gain = 0;
  ConstrainedVelocity without = bench.Make();
  ConstrainedVelocity with = Bench("panda").Make();
  const VectorXd middle = 0.5 * (bench.model->lower() + bench.model->upper());
  goal = bench.HandAt(Pose(bench.X_WH(middle).R, bench.X_WH(middle).p + Vector3d(0, 0, -0.05)));
  EXPECT_LT((bench.Compute(with, middle, &goal) - bench.Compute(without, middle, &goal)).norm(), 1e-9);
}

TEST(ConstrainedVelocityPosture, ExtraFieldsSayHowFarTheyAreFromHolding) {
  Bench bench("panda");
  ConstrainedVelocity controller = bench.Make();
  const VectorXd q = bench.model->home();
  const Pose X_BH = bench.X_WBase.Inverse() * bench.X_WH(q);
  const auto cone = constraints::MakePointCone(0.02, {0.1, 0, 0.3}, Vector3d::Zero());
  Frame target;
  target.X_OF = Pose(X_BH.p - Vector3d(0.05, 0, 0));
  controller.SetExtraFields({{"cone", cone, target, {}}});
  bench.Compute(controller, q);
  EXPECT_NEAR(controller.extra_violation_m(), 0.03, 1e-6);
  EXPECT_EQ(controller.extra_violation_rad(), 0);
  controller.SetExtraFields({{"cone", cone, target, {}, 1}});
  bench.Compute(controller, q);
  EXPECT_EQ(controller.extra_violation_m(), 0) << "it may be relaxed";
}

INSTANTIATE_TEST_SUITE_P(Robots, ConstrainedVelocityTest, ::testing::Values("j2n6s300", "panda"));

}  // namespace
}  // namespace tether::control
