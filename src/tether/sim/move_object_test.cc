#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "testing/sim/test_scenes.h"

namespace tether::sim {
namespace {

const Eigen::Vector3d kCube(0.05, 0.05, 0.05);

math::Pose PoseOf(const World& world, const std::string& name) { return world.Truth().X_WO.at(name); }

void ExpectNear(const math::Pose& a, const math::Pose& b, double distance, double angle) {
  EXPECT_LT((a.p - b.p).norm(), distance) << a.p.transpose() << " against " << b.p.transpose();
  EXPECT_LT(math::AngleBetween(a.R, b.R), angle);
}

// Runs for a time; returns the greatest speed of an object, and checks that it never jumped.
double RunWatching(World* world, const std::string& name, double duration) {
  const double end = world->time() + duration;
  double fastest = 0;
  Eigen::Vector3d before = PoseOf(*world, name).p;
  while (world->time() < end - 1e-9) {
    world->Apply({}, 0.001);
    const Eigen::Vector3d now = PoseOf(*world, name).p;
    fastest = std::max(fastest, (now - before).norm() / 0.001);
    before = now;
  }
  return fastest;
}

TEST(MoveObjectTest, AMovableObjectArrivesInTimeAndIsFreeAgain) {
  scene::Scene scene;
  scene.objects = {MakeTable(), MakeObject("box", geometry::Box{kCube}, {0.4, 0, 0.025}, 0.1)};
  World world(scene, {});
  RunWatching(&world, "box", 0.2);
  const math::Pose goal(math::RotationFromRpy({0, 0, 0.6}), Eigen::Vector3d(0.4, 0.1, 0.025));
  world.MoveObject("box", goal, 1.0);
  const double fastest = RunWatching(&world, "box", 1.0);
  ExpectNear(PoseOf(world, "box"), goal, 5e-4, 5e-3);
  EXPECT_GT(fastest, 0.15);
  EXPECT_LT(fastest, 0.21);
  RunWatching(&world, "box", 1.0);
  ExpectNear(PoseOf(world, "box"), goal, 6e-4, 6e-3);
  world.MoveObject("box", math::Pose(Eigen::Vector3d(0.4, 0.1, 0.3)), 1.0);
  RunWatching(&world, "box", 1.0);
  EXPECT_NEAR(PoseOf(world, "box").p.z(), 0.3, 1e-3);
  RunWatching(&world, "box", 1.0);
  EXPECT_NEAR(PoseOf(world, "box").p.z(), 0.025, 1e-3);
}

TEST(MoveObjectTest, AFixedObjectCarriesWhatRestsOnIt) {
  scene::Scene scene;
  scene.objects = {MakeTable(), MakeObject("shelf", geometry::Box{{0.3, 0.3, 0.1}}, {0.4, 0, 0.05}),
                   MakeObject("rim", geometry::Box{{0.3, 0.02, 0.05}}, {0, 0.14, 0.075}),
                   MakeObject("box", geometry::Box{kCube}, {0.45, 0.05, 0.125}, 0.1)};
  scene.objects[2].parent = "shelf";
  World world(scene, {});
  RunWatching(&world, "box", 0.2);
  const math::Pose X_WBox = PoseOf(world, "box");
  const math::Pose X_WShelf = PoseOf(world, "shelf");
  const math::Pose goal(math::RotationFromRpy({0, 0, 0.3}), Eigen::Vector3d(0.45, 0.15, 0.07));
  world.MoveObject("shelf", goal, 1.5);
  const double fastest = RunWatching(&world, "shelf", 1.5);
  EXPECT_LT(fastest, 0.25);
  ExpectNear(PoseOf(world, "shelf"), goal, 1e-9, 1e-7);
  // The box moved with the shelf; so did the rim, which is mounted on it.
  ExpectNear(PoseOf(world, "box"), goal * X_WShelf.Inverse() * X_WBox, 1e-3, 5e-3);
  ExpectNear(PoseOf(world, "rim"), goal * math::Pose(Eigen::Vector3d(0, 0.14, 0.075)), 1e-9, 1e-7);
  EXPECT_EQ(world.ObjectVelocity("box").norm() > 0.01, false);
  RunWatching(&world, "box", 2.0);
  ExpectNear(PoseOf(world, "shelf"), goal, 1e-9, 1e-7);
  ExpectNear(PoseOf(world, "box"), goal * X_WShelf.Inverse() * X_WBox, 1e-3, 5e-3);
}

TEST(MoveObjectTest, AMovedFixedObjectBearsLoads) {
  scene::Scene scene;
  scene.objects = {MakeObject("shelf", geometry::Box{{0.3, 0.3, 0.1}}, {0.4, 0, 0.05}),
                   MakeObject("anvil", geometry::Box{{0.2, 0.2, 0.2}}, {0.4, 0, 0.2}, 20.0)};
  World world(scene, {});
  world.MoveObject("shelf", math::Pose(Eigen::Vector3d(0.5, 0, 0.05)), 1.0);
  RunWatching(&world, "anvil", 3.0);
  ExpectNear(PoseOf(world, "shelf"), math::Pose(Eigen::Vector3d(0.5, 0, 0.05)), 1e-9, 1e-7);
  ExpectNear(PoseOf(world, "anvil"), math::Pose(Eigen::Vector3d(0.5, 0, 0.2)), 1e-3, 1e-3);
  EXPECT_NEAR(world.ContactForce("anvil", "shelf"), 20 * 9.81, 1);
}

TEST(MoveObjectTest, AWallHoldsAMovableObjectUp) {
  scene::Scene scene;
  scene.objects = {MakeTable(), MakeObject("wall", geometry::Box{{0.02, 0.5, 0.3}}, {0.5, 0, 0.15}),
                   MakeObject("box", geometry::Box{kCube}, {0.4, 0, 0.025}, 0.1)};
  World world(scene, {});
  world.MoveObject("box", math::Pose(Eigen::Vector3d(0.6, 0, 0.025)), 1.0);
  const double fastest = RunWatching(&world, "box", 2.0);
  EXPECT_LT(fastest, 0.8);
  // It leaned on the wall, and may have sprung back a little when it was released.
  EXPECT_NEAR(PoseOf(world, "box").p.x(), 0.46, 6e-3);
}

TEST(MoveObjectTest, AFixedObjectPushesTheHand) {
  scene::Scene scene;
  scene.objects = {MakeTable(), MakeObject("wall", geometry::Box{{0.02, 0.3, 0.4}}, {0.6, 0, 0.2})};
  scene.robots = {MakePanda()};
  World world(scene, {{"panda", Panda()}});
  TestServo servo(&world, "panda");
  servo.MoveTo({Down(), {0.45, 0, 0.2}}, 1.0);
  world.MoveObject("wall", math::Pose(Eigen::Vector3d(0.48, 0, 0.2)), 1.0);
  servo.Wait(1.5);
  EXPECT_LT(servo.X_BH().p.x(), 0.45);
  EXPECT_GT(world.ContactForce("panda", "wall"), 1.0);
  EXPECT_GT(world.Observe().at("panda").tau_external.norm(), 0.5);
}

TEST(MoveObjectTest, ASteadyMoveHasOneSpeed) {
  scene::Scene scene;
  scene.objects = {MakeObject("ball", geometry::Box{kCube}, {0.4, 0, 0.5})};
  World world(scene, {});
  world.MoveObject("ball", math::Pose(Eigen::Vector3d(0.4, 0.4, 0.5)), 2.0, true);
  for (int tick = 1; tick < 10; ++tick) {
    RunWatching(&world, "ball", 0.2);
    EXPECT_NEAR(PoseOf(world, "ball").p.y(), 0.04 * tick, 1e-3);
  }
}

TEST(MoveObjectTest, ASecondMoveReplacesTheFirst) {
  scene::Scene scene;
  scene.objects = {MakeTable(), MakeObject("box", geometry::Box{kCube}, {0.4, 0, 0.025}, 0.1)};
  World world(scene, {});
  world.MoveObject("box", math::Pose(Eigen::Vector3d(0.6, 0, 0.025)), 1.0);
  RunWatching(&world, "box", 0.5);
  world.MoveObject("box", math::Pose(Eigen::Vector3d(0.4, 0.1, 0.025)), 1.0);
  RunWatching(&world, "box", 1.0);
  EXPECT_LT((PoseOf(world, "box").p - Eigen::Vector3d(0.4, 0.1, 0.025)).norm(), 1e-3);
}

TEST(MoveObjectTest, PlacingIsAtOnceAndAtRest) {
  scene::Scene scene;
  scene.objects = {MakeTable(), MakeObject("shelf", geometry::Box{{0.3, 0.3, 0.1}}, {0.4, 0, 0.05}),
                   MakeObject("box", geometry::Box{kCube}, {0.45, 0.3, 0.025}, 0.1)};
  World world(scene, {});
  world.PlaceObject("shelf", math::Pose(Eigen::Vector3d(0.4, -0.2, 0.05)));
  world.PlaceObject("box", math::Pose(Eigen::Vector3d(0.4, -0.2, 0.125)));
  RunWatching(&world, "box", 1.0);
  ExpectNear(PoseOf(world, "shelf"), math::Pose(Eigen::Vector3d(0.4, -0.2, 0.05)), 1e-12, 1e-7);
  ExpectNear(PoseOf(world, "box"), math::Pose(Eigen::Vector3d(0.4, -0.2, 0.125)), 1e-4, 1e-4);
}

}  // namespace
}  // namespace tether::sim
