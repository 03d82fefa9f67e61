#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/evaluation/run_plan.h"
#include "testing/execution/test_plans.h"

namespace tether::execution {
namespace {

using math::Pose;

const geometry::Shape kCube = geometry::Primitive(geometry::Box{{0.05, 0.05, 0.05}});

scene::Scene OneBox() {
  scene::Scene scene = TableScene();
  scene.objects.push_back(MakeObject("box", kCube, Pose(Eigen::Vector3d(0.5, 0.15, 0.025))));
  return scene;
}

// The table's frame is 0.25 m below its top, half a metre in front of the robot.
Pose OnTable(double x, double y, double z, double yaw = 0) {
  return Pose(math::ExpSO3({0, 0, yaw}), {x - 0.5, y, z + 0.25});
}

planning::Plan PickAndPlace() {
  return PlanBuilder()
      .Pick("box", TopGrasp({0, 0, 0}))
      .Place("box", "table", OnTable(0.45, -0.2, 0.025, 0.5))
      .Build();
}

void ExpectAt(const RunResult& run, const std::string& object, const Eigen::Vector3d& p,
              double tolerance = 0.008) {
  EXPECT_LT((run.truth.X_WO.at(object).p - p).norm(), tolerance)
      << object << " at " << run.truth.X_WO.at(object).p.transpose() << "\n"
      << run.Log();
}

TEST(ExecutiveSim, PicksAndPlaces) {
  Random random(11);
  for (int seed = 0; seed < 3; ++seed) {
    scene::Scene scene = OneBox();
    Perturb(&scene, &random);
    const RunResult run = RunPlan(scene, PickAndPlace());
    EXPECT_EQ(run.status.state, ExecutiveStatus::State::kFinished) << run.Log();
    EXPECT_EQ(run.retries, 0) << run.Log();
    ExpectAt(run, "box", {0.45, -0.2, 0.025}, 0.004);
  }
}

// Paper A's claim: the plan stays valid while objects move.
TEST(ExecutiveSim, FollowsABoxThatMovesDuringTheApproach) {
  bool moved = false;
  const auto disturb = [&](sim::World& world, const Executive&) {
    if (moved || world.time() < 0.8) return;
    moved = true;
    Pose X_WO = world.Truth().X_WO.at("box");
    X_WO.p.y() += 0.10;
    world.MoveObject("box", X_WO, 1.0);
  };
  const RunResult run = RunPlan(OneBox(), PickAndPlace(), disturb);
  EXPECT_EQ(run.status.state, ExecutiveStatus::State::kFinished) << run.Log();
  EXPECT_EQ(run.retries, 0) << run.Log();
  ExpectAt(run, "box", {0.45, -0.2, 0.025}, 0.004);
}

TEST(ExecutiveSim, FollowsATargetThatMovesDuringThePlace) {
  scene::Scene scene = OneBox();
  scene.objects.push_back(MakeFixed("shelf", geometry::Primitive(geometry::Box{{0.2, 0.2, 0.1}}),
                                    Pose(Eigen::Vector3d(0.4, -0.3, 0.05))));
  const planning::Plan plan = PlanBuilder()
                                  .Pick("box", TopGrasp({0, 0, 0}))
                                  .Place("box", "shelf", Pose(Eigen::Vector3d(0.03, 0.02, 0.075)))
                                  .Build();
  bool moved = false;
  const auto disturb = [&](sim::World& world, const Executive& executive) {
    if (moved || executive.step() < 1) return;
    moved = true;
    Pose X_WO = world.Truth().X_WO.at("shelf");
    X_WO.p.x() += 0.05;
    world.MoveObject("shelf", X_WO, 2.0);
  };
  const RunResult run = RunPlan(scene, plan, disturb);
  EXPECT_EQ(run.status.state, ExecutiveStatus::State::kFinished) << run.Log();
  ExpectAt(run, "box", {0.48, -0.28, 0.125}, 0.005);
}

TEST(ExecutiveSim, StacksAndPassesAboveObstructions) {
  Random random(12);
  scene::Scene scene = OneBox();
  scene.objects.push_back(MakeObject("base", kCube, Pose(Eigen::Vector3d(0.5, -0.15, 0.025))));
  scene.objects.push_back(MakeObject("tower", geometry::Primitive(geometry::Box{{0.05, 0.05, 0.25}}),
                                     Pose(Eigen::Vector3d(0.5, 0.0, 0.125))));
  Perturb(&scene, &random);
  const Pose X_WTower = scene.InitialPose("tower");
  const Pose X_WBase = scene.InitialPose("base");
  const planning::Plan plan = PlanBuilder()
                                  .Pick("box", TopGrasp({0, 0, 0}))
                                  .Place("box", "base", Pose(Eigen::Vector3d(0, 0, 0.05)))
                                  .Home(TopGrasp({0.375, 0, 0.3}))
                                  .Build();
  const RunResult run = RunPlan(scene, plan);
  EXPECT_EQ(run.status.state, ExecutiveStatus::State::kFinished) << run.Log();
  EXPECT_EQ(run.retries, 0) << run.Log();
  ExpectAt(run, "box", X_WBase * Eigen::Vector3d(0, 0, 0.05), 0.005);
  ExpectAt(run, "tower", X_WTower.p, 0.001);
}

// The whole of Workspace Reach, with the numbers that worked by hand: pull the box nearer with the hook, put
// the hook back, and put the box on the shelf.
TEST(ExecutiveSim, PullsTheBoxNearWithAHook) {
  Random random(13);
  scene::Scene scene = TableScene();
  scene.objects.push_back(MakeFixed("shelf", geometry::Primitive(geometry::Box{{0.3, 0.3, 0.1}}),
                                    Pose(Eigen::Vector3d(0.35, -0.35, 0.05))));
  scene.objects.push_back(MakeObject("box", kCube, Pose(Eigen::Vector3d(0.9, 0, 0.025))));
  scene.objects.push_back(MakeObject("hook", HookShape(), Pose(Eigen::Vector3d(0.9, 0.3, 0.01))));
  Perturb(&scene, &random);
  Pose X_BoxHook(Eigen::Vector3d(0, 0, -0.015));
  X_BoxHook.p.x() = 0.025 + 0.01 - 0.035;
  const planning::Plan plan = PlanBuilder()
                                  .Pick("hook", TopGrasp({-0.195, 0.05, 0.0045}))
                                  .Push("hook", "box", "table", X_BoxHook, OnTable(0.68, 0, 0.025))
                                  .Place("hook", "table", OnTable(0.85, 0.3, 0.01))
                                  .Pick("box", TopGrasp({0, 0, 0}))
                                  .Place("box", "shelf", Pose(Eigen::Vector3d(0, 0, 0.075)))
                                  .Home(TopGrasp({0.375, 0, 0.276}))
                                  .Build();
  const RunResult run = RunPlan(scene, plan);
  EXPECT_EQ(run.status.state, ExecutiveStatus::State::kFinished) << run.Log();
  ExpectAt(run, "box", {0.35, -0.35, 0.125});
  EXPECT_EQ(run.retries, 0) << run.Log();
  ExpectAt(run, "hook", {0.85, 0.3, 0.01});
}

// A box that moves while the fingers are around it is neither chased off the table nor swept away.
TEST(ExecutiveSim, StepsBackWhenTheBoxMovesInTheLastMoment) {
  bool moved = false;
  const auto disturb = [&](sim::World& world, const Executive& executive) {
    if (moved || world.time() < 1.5 || executive.records()[0].position_error > 0.02) return;
    moved = true;
    world.PlaceObject("box", Pose(Eigen::Vector3d(0.45, 0.3, 0.025)));
  };
  const RunResult run = RunPlan(OneBox(), PickAndPlace(), disturb);
  EXPECT_TRUE(moved);
  EXPECT_EQ(run.status.state, ExecutiveStatus::State::kFinished) << run.Log();
  EXPECT_EQ(run.retries, 0) << run.Log();
  ExpectAt(run, "box", {0.45, -0.2, 0.025}, 0.004);
}

// The box is snatched away as the fingers close: they close on nothing, and the pick starts over where the
// box is now.
TEST(ExecutiveSim, TriesAgainWhenTheGraspIsMissed) {
  bool moved = false;
  const auto disturb = [&](sim::World& world, const Executive&) {
    if (moved || world.time() < 1.5 || world.Observe().at("panda").gripper_opening > 0.07) return;
    moved = true;
    world.PlaceObject("box", Pose(Eigen::Vector3d(0.45, 0.3, 0.025)));
  };
  const RunResult run = RunPlan(OneBox(), PickAndPlace(), disturb);
  EXPECT_EQ(run.status.state, ExecutiveStatus::State::kFinished) << run.Log();
  EXPECT_EQ(run.retries, 1) << run.Log();
  ExpectAt(run, "box", {0.45, -0.2, 0.025}, 0.004);
}

// The box is lost in transfer: execution resumes with picking it up.
TEST(ExecutiveSim, PicksUpWhatItLost) {
  bool moved = false;
  const auto disturb = [&](sim::World& world, const Executive& executive) {
    if (moved || executive.step() < 1 || executive.records()[1].start + 0.8 > world.time()) return;
    moved = true;
    world.PlaceObject("box", Pose(Eigen::Vector3d(0.55, 0.2, 0.025)));
  };
  const RunResult run = RunPlan(OneBox(), PickAndPlace(), disturb);
  EXPECT_EQ(run.status.state, ExecutiveStatus::State::kFinished) << run.Log();
  EXPECT_EQ(run.Count(EventKind::kGraspLost), 1) << run.Log();
  EXPECT_EQ(run.Count(EventKind::kGrasped), 2) << run.Log();
  ExpectAt(run, "box", {0.45, -0.2, 0.025}, 0.004);
}

// With nothing in the hand, the hand itself pushes.
TEST(ExecutiveSim, PushesWithTheHand) {
  scene::Scene scene = TableScene();
  scene.objects.push_back(MakeObject("bar", geometry::Primitive(geometry::Box{{0.12, 0.05, 0.05}}),
                                     Pose(Eigen::Vector3d(0.5, 0.15, 0.025))));
  const planning::Plan plan = PlanBuilder()
                                  .Push("hand", "bar", "table", TopGrasp({0, 0.037, 0}, std::numbers::pi / 2),
                                        OnTable(0.5, -0.05, 0.025))
                                  .Build();
  const RunResult run = RunPlan(scene, plan);
  EXPECT_EQ(run.status.state, ExecutiveStatus::State::kFinished) << run.Log();
  EXPECT_EQ(run.retries, 0) << run.Log();
  ExpectAt(run, "bar", {0.5, -0.05, 0.025}, 0.01);
}

// Moving and turning the whole world, robot included, changes nothing.
TEST(ExecutiveSim, DoesNotCareWhereTheWorldIs) {
  const Pose X_WorldHere(math::ExpSO3({0, 0, 2}), {1, -2, 0.3});
  scene::Scene scene = OneBox();
  for (scene::Object& object : scene.objects) object.X_ParentObject = X_WorldHere * object.X_ParentObject;
  scene.robots[0].X_ParentBase = X_WorldHere;
  const RunResult run = RunPlan(scene, PickAndPlace());
  EXPECT_EQ(run.status.state, ExecutiveStatus::State::kFinished) << run.Log();
  EXPECT_EQ(run.retries, 0) << run.Log();
  ExpectAt(run, "box", X_WorldHere * Eigen::Vector3d(0.45, -0.2, 0.025), 0.004);
}

TEST(ExecutiveSim, IsDeterministic) {
  const RunResult first = RunPlan(OneBox(), PickAndPlace());
  const RunResult second = RunPlan(OneBox(), PickAndPlace());
  EXPECT_EQ(first.Log(), second.Log());
  EXPECT_EQ(first.truth.X_WO.at("box").p, second.truth.X_WO.at("box").p);
  EXPECT_EQ(first.truth.X_WO.at("box").R, second.truth.X_WO.at("box").R);
}

}  // namespace
}  // namespace tether::execution
