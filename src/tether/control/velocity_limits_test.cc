// What the velocity controller commands, followed by a servo that overshoots: limits of joints come before
// distances, and nothing jumps.

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "testing/control/sign_changes.h"
#include "tether/constraints/core/field_function.h"
#include "tether/control/constrained_velocity.h"
#include "tether/control/objective.h"

namespace tether::control {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using math::Pose;

/// A robot's own servo of velocities: critically damped about the integral of what it is told, so that it
/// overshoots a step by 13.5 %.
struct ServoedArm {
  explicit ServoedArm(const robot::Model& model)
      : q(model.home()), v(VectorXd::Zero(model.dof())), reference(q) {}
  void Follow(const VectorXd& command, double period) {
    constexpr double kRate = 50, kStep = 2.5e-4;
    for (double t = 0; t < period - 1e-9; t += kStep) {
      reference += kStep * command;
      v += kStep * (kRate * kRate * (reference - q) + 2 * kRate * (command - v));
      q += kStep * v;
    }
  }
  VectorXd q, v, reference;
};

class VelocityLimitsTest : public ::testing::TestWithParam<std::string> {};

// A ball rushes at the hand, from all sides, faster than the arm can evade.
TEST_P(VelocityLimitsTest, JointsStayWithinTheirSpeedWhateverTheServoOvershoots) {
  const auto model = robot::Model::Load(GetParam());
  ClearanceConstraint clearance{"clearance", {}, true, {0}, 0.02, 0};
  for (int body = 0; body <= model->solids().hand(); ++body) clearance.of.push_back(body);
  double fastest = 0;
  for (int side = 0; side < 12; ++side) {
    const std::vector<Solid> solids = {{"ball", geometry::Primitive(geometry::Sphere{0.06}), true}};
    ConstrainedVelocity controller(model, Pose(), solids, {clearance}, {}, {});
    ServoedArm arm(*model);
    robot::Kinematics kinematics(model);
    kinematics.Set(arm.q);
    const double angle = side * M_PI / 6;
    const Vector3d along(std::cos(angle), std::sin(angle), side % 3 == 0 ? 0.5 : 0);
    const Vector3d start = kinematics.X_BH().p - 0.5 * along;
    for (int tick = 0; tick < 200; ++tick) {
      std::vector<MovingPose> poses(1);
      poses[0].X.p = start + 1.2 * 0.005 * tick * along;
      poses[0].V.head<3>() = 1.2 * along;
      arm.Follow(controller.Compute({arm.q, 0.04, poses, &arm.v}, nullptr), 0.005);
      for (int i = 0; i < model->dof(); ++i) {
        const double share = std::abs(arm.v[i]) / model->max_velocity()[i];
        ASSERT_LE(share, 1) << "side " << side << ", tick " << tick << ", joint " << i;
        fastest = std::max(fastest, share);
      }
    }
  }
  EXPECT_GT(fastest, 0.6) << "nothing had to be fast";
}

// A wall in front of the hand, beyond which it is to go: it stands still, no joint goes to and fro.
TEST_P(VelocityLimitsTest, StandsStillAtAnObstacle) {
  const auto model = robot::Model::Load(GetParam());
  ClearanceConstraint clearance{"clearance", {}, true, {0}, 0.01, 0};
  for (int body = 0; body <= model->solids().hand(); ++body) clearance.of.push_back(body);
  const std::vector<Solid> solids = {{"wall", geometry::Primitive(geometry::Box{{0.04, 1.0, 1.0}}), false}};
  ConstrainedVelocity controller(model, Pose(), solids, {clearance}, {}, {});
  ServoedArm arm(*model);
  robot::Kinematics kinematics(model);
  kinematics.Set(arm.q);
  const Pose X_BH = kinematics.X_BH();
  const std::vector<MovingPose> poses = {{Pose(Vector3d(X_BH.p.x() + 0.15, X_BH.p.y(), 0.5))}};
  Goal goal;
  goal.functions = MakeObjective(Objective::kPose, Pose(X_BH.R, X_BH.p + Vector3d(0.4, 0, 0)));
  SignChanges changes(model->dof());
  for (int tick = 0; tick < 2400; ++tick) {
    arm.Follow(controller.Compute({arm.q, 0.04, poses, &arm.v}, &goal), 0.005);
    if (tick > 400) changes.Observe(0.005 * tick, arm.v);
  }
  EXPECT_EQ(changes.count(), 0);
  EXPECT_LT(arm.v.norm(), 5e-3);
}

class Broken final : public constraints::PoseFunction {
 public:
  Broken() : PoseFunction(1, 2, nlp::Unit::kMetre) {}
  void Evaluate(std::span<const Pose> /*X*/, nlp::VectorRef r, nlp::JacobianRef* J) const override {
    r[0] = broken ? std::numeric_limits<double>::quiet_NaN() : -1;
    if (J != nullptr) J->setZero();
  }
  bool broken = false;
};

TEST_P(VelocityLimitsTest, ARowThatIsNotFiniteStopsTheArmInsteadOfBeingDropped) {
  const auto model = robot::Model::Load(GetParam());
  const auto field = std::make_shared<Broken>();
  ConstrainedVelocity controller(model, Pose(), {}, {}, {{"field", field, {}, {}, 0}}, {});
  robot::Kinematics kinematics(model);
  kinematics.Set(model->home());
  Goal goal;
  goal.functions = MakeObjective(Objective::kPosition, kinematics.X_BH() * Pose(Vector3d(0.1, 0.1, -0.1)));
  double speed = 0;
  for (int i = 0; i < 30; ++i) speed = controller.Compute({model->home(), 0.04, {}}, &goal).norm();
  EXPECT_GT(speed, 0.05);
  field->broken = true;
  for (int i = 0; i < 60; ++i) speed = controller.Compute({model->home(), 0.04, {}}, &goal).norm();
  EXPECT_TRUE(controller.flags().fault);
  EXPECT_EQ(speed, 0);
  field->broken = false;
  for (int i = 0; i < 30; ++i) speed = controller.Compute({model->home(), 0.04, {}}, &goal).norm();
  EXPECT_FALSE(controller.flags().fault);
  EXPECT_GT(speed, 0.05);
}

INSTANTIATE_TEST_SUITE_P(Robots, VelocityLimitsTest, ::testing::Values("panda", "j2n6s300"));

}  // namespace
}  // namespace tether::control
