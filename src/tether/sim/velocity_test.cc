#include <cmath>

#include <gtest/gtest.h>

#include "testing/sim/test_scenes.h"
#include "tether/common/error.h"
#include "tether/robot/kinematics.h"

namespace tether::sim {
namespace {

using Eigen::VectorXd;

std::shared_ptr<const robot::Model> Jaco() {
  static const std::shared_ptr<const robot::Model> model = robot::Model::Load("j2n6s300");
  return model;
}

struct Arm {
  std::string name;
  std::shared_ptr<const robot::Model> model;
};

scene::Robot MakeRobot(const Arm& arm) {
  scene::Robot robot;
  robot.name = robot.model = arm.name;
  return robot;
}

robot::Commands Velocity(const Arm& arm, const VectorXd& v) {
  robot::Commands commands;
  robot::Command& command = commands[arm.name];
  command.mode = robot::Command::Mode::kVelocity;
  command.velocity = v;
  command.gripper.opening = arm.model->gripper().max_opening;
  return commands;
}

class VelocityTest : public ::testing::TestWithParam<std::string> {
 protected:
  Arm arm_{GetParam(), robot::Model::Load(GetParam())};
};

TEST_P(VelocityTest, TheArmFollowsAndDoesNotSag) {
  scene::Scene scene;
  scene.robots = {MakeRobot(arm_)};
  World world(scene, {{arm_.name, arm_.model}});
  const int n = arm_.model->dof();
  const VectorXd start = world.Observe().at(arm_.name).q;
  VectorXd expected = start;
  for (int tick = 0; tick < 400; ++tick) {
    const VectorXd v = 0.3 * std::sin(0.005 * tick * M_PI) * VectorXd::LinSpaced(n, -1, 1);
    world.Apply(Velocity(arm_, v), 0.005);
    expected += 0.005 * v;
    EXPECT_LT((world.Observe().at(arm_.name).q - expected).cwiseAbs().maxCoeff(), 5e-3);
  }
  for (int tick = 0; tick < 1000; ++tick) world.Apply(Velocity(arm_, VectorXd::Zero(n)), 0.005);
  const robot::Observation seen = world.Observe().at(arm_.name);
  EXPECT_LT((seen.q - expected).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_LT(seen.v.norm(), 1e-3);
}

TEST_P(VelocityTest, VelocitiesAreLimitedAndChecked) {
  scene::Scene scene;
  scene.robots = {MakeRobot(arm_)};
  World world(scene, {{arm_.name, arm_.model}});
  const int n = arm_.model->dof();
  VectorXd v = VectorXd::Zero(n);
  v[0] = 100;
  for (int tick = 0; tick < 100; ++tick) world.Apply(Velocity(arm_, v), 0.005);
  EXPECT_LT(world.Observe().at(arm_.name).v[0], 1.02 * arm_.model->max_velocity()[0]);
  EXPECT_GT(world.Observe().at(arm_.name).v[0], 0.9 * arm_.model->max_velocity()[0]);
  v[0] = std::nan("");
  EXPECT_THROW(world.Apply(Velocity(arm_, v), 0.005), InputError);
  EXPECT_THROW(world.Apply(Velocity(arm_, VectorXd::Zero(n + 1)), 0.005), InputError);
}

INSTANTIATE_TEST_SUITE_P(Robots, VelocityTest, ::testing::Values("j2n6s300", "panda"));

// A box 4 cm wide, grasped from above between three fingers, is lifted and held for ten seconds.
TEST(ThreeFingersTest, HoldABoxByFriction) {
  const Arm arm{"j2n6s300", Jaco()};
  scene::Scene scene;
  robot::Kinematics kinematics(arm.model);
  const math::Pose X_WH = kinematics.X_BH();
  // Under the hand at home, its narrow sides along the hand's y axis, its top 3 cm above the grasp point.
  scene::Object box =
      MakeObject("box", geometry::Box{{0.06, 0.04, 0.10}}, X_WH.p - Eigen::Vector3d(0, 0, 0.02), 0.1);
  const double yaw = std::atan2(X_WH.R(1, 1), X_WH.R(0, 1)) - M_PI / 2;
  box.X_ParentObject.R = math::RotationFromRpy({0, 0, yaw});
  scene::Object stand =
      MakeObject("stand", geometry::Box{{0.08, 0.08, 0.02}}, X_WH.p - Eigen::Vector3d(0, 0, 0.08));
  scene.objects = {box, stand};
  scene.robots = {MakeRobot(arm)};
  World world(scene, {{arm.name, arm.model}});
  robot::Commands commands = Velocity(arm, VectorXd::Zero(6));
  robot::GripperCommand& gripper = commands[arm.name].gripper;
  gripper.mode = robot::GripperCommand::Mode::kForce;
  gripper.force = arm.model->gripper().max_force;
  for (int tick = 0; tick < 300; ++tick) world.Apply(commands, 0.005);
  const auto X_HO = [&] {
    kinematics.Set(world.Observe().at(arm.name).q);
    return math::Between(kinematics.X_BH(), world.Truth().X_WO.at("box"));
  };
  const math::Pose held = X_HO();
  EXPECT_GT(world.ContactForce(arm.name, "box"), 4);
  EXPECT_GT(world.Observe().at(arm.name).gripper_opening, 0.01);
  commands[arm.name].velocity[1] = 0.2;
  for (int tick = 0; tick < 200; ++tick) world.Apply(commands, 0.005);
  commands[arm.name].velocity[1] = 0;
  for (int tick = 0; tick < 2000; ++tick) world.Apply(commands, 0.005);
  EXPECT_EQ(world.ContactForce("stand", "box"), 0);
  EXPECT_LT((X_HO().p - held.p).norm(), 0.004);
  EXPECT_LT(math::AngleBetween(X_HO().R, held.R), 0.06);
  gripper.mode = robot::GripperCommand::Mode::kOpening;
  gripper.opening = arm.model->gripper().max_opening;
  for (int tick = 0; tick < 200; ++tick) world.Apply(commands, 0.005);
  EXPECT_NEAR(world.Observe().at(arm.name).gripper_opening, gripper.opening, 4e-3);
  EXPECT_EQ(world.ContactForce(arm.name, "box"), 0);
}

}  // namespace
}  // namespace tether::sim
