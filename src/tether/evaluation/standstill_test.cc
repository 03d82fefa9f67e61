// An obstacle that is held in front of the hand for ten seconds, in the simulation, with either command.

#include <algorithm>

#include <gtest/gtest.h>

#include "testing/control/sign_changes.h"
#include "testing/control/torque_arm.h"
#include "tether/control/objective.h"
#include "tether/execution/servo/torque_servo.h"
#include "tether/sim/world.h"

namespace tether::evaluation {
namespace {

using control::KeepClear;
using Eigen::Vector3d;
using math::Pose;

/// The hand is led forward; a board comes from the side and stays in its way.
class Standstill : public ::testing::TestWithParam<bool> {
 protected:
  Standstill() {
    const Eigen::VectorXd& home = model_->home();
    scene::Robot& arm = scene_.robots.emplace_back();
    arm.name = arm.model = "panda";
    arm.q.assign(home.data(), home.data() + home.size());
    scene::Object board;
    board.name = "board";
    board.shape = geometry::Primitive(geometry::Box{{0.04, 0.5, 0.6}});
    board.X_ParentObject = Pose(Vector3d(0.72, 0.9, 0.5));
    scene_.objects.push_back(board);
  }

  std::shared_ptr<const robot::Model> model_ = robot::Model::Load("panda");
  scene::Scene scene_;
};

TEST_P(Standstill, AtAnObstacleNoJointGoesToAndFro) {
  const bool torques = GetParam();
  const double period = torques ? 0.001 : 0.005;
  sim::World world(scene_, {{"panda", model_}});
  execution::TorqueServoOptions options;
  options.controller.period = period;
  execution::TorqueServo servo(scene_, "panda", model_, options);
  control::VelocityOptions velocity_options;
  velocity_options.period = period;
  control::ConstrainedVelocity velocity(model_, Pose(), {{"board", scene_.objects[0].shape, false}},
                                        {KeepClear(*model_, {0}, 0)}, {}, velocity_options);
  robot::State state(model_);
  const Pose X_WH = state.X_BH(), X_WGoal(X_WH.R, X_WH.p + Vector3d(0.3, 0, 0));
  control::Goal goal;
  goal.functions = control::MakeObjective(control::Objective::kPose, X_WGoal);
  robot::Commands commands;
  robot::Command& command = commands["panda"];
  command.mode = torques ? robot::Command::Mode::kTorque : robot::Command::Mode::kVelocity;
  command.gripper.opening = 0.08;
  control::SignChanges changes(model_->dof());
  world.MoveObject("board", Pose(Vector3d(0.72, 0, 0.5)), 4);
  double reference = 0, speed = 0;
  while (world.time() < 17) {
    const robot::Observation seen = world.Observe().at("panda");
    state.Set(seen.q, seen.v);
    IndexedVector<ObjectId, control::MovingPose> objects(1);
    objects[ObjectId(0)] = {world.Truth().X_WO.at("board"), world.ObjectVelocity("board")};
    if (torques) {
      reference = std::min(0.3, reference + 0.05 * period);
      control::HandTarget target;
      target.X_BH = Pose(X_WH.R, X_WH.p + Vector3d(reference, 0, 0));
      command.torque = servo.Compute({state,
                                      seen.gripper_opening,
                                      objects,
                                      seen.tau_external,
                                      target,
                                      model_->home(),
                                      {},
                                      {},
                                      options.max_force});
    } else {
      command.velocity = velocity.Compute({seen.q, seen.gripper_opening, objects.values(), &seen.v}, &goal);
    }
    // The board is there at 4 s, and the hand at the board at 6 s.
    if (world.time() > 7) changes.Observe(world.time(), seen.v);
    speed = seen.v.cwiseAbs().maxCoeff();
    world.Apply(commands, period);
  }
  EXPECT_EQ(changes.count(), 0);
  EXPECT_LT(speed, 0.01);
  EXPECT_LT(state.X_BH().p.x(), 0.72) << "the board was in the way";
}

INSTANTIATE_TEST_SUITE_P(Commands, Standstill, ::testing::Values(true, false),
                         [](const auto& test) { return test.param ? "Torques" : "Velocities"; });

}  // namespace
}  // namespace tether::evaluation
