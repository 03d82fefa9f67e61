#include <cmath>

#include <gtest/gtest.h>

#include "testing/sim/test_scenes.h"

namespace tether::sim {
namespace {

struct Slip {
  double distance;
  double angle;
};

// How far a held object has moved in the hand since `X_HO`.
Slip SlipSince(const math::Pose& X_HO, const math::Pose& X_WH, const math::Pose& X_WO) {
  const math::Pose now = math::Between(X_WH, X_WO);
  return {(now.p - X_HO.p).norm(), math::AngleBetween(now.R, X_HO.R)};
}

TEST(GraspTest, FrictionHoldsABox) {
  scene::Scene scene;
  scene.objects = {MakeTable(),
                   MakeObject("box", geometry::Box{{0.05, 0.05, 0.05}}, {0.5, 0.003, 0.025}, 0.1)};
  scene.robots = {MakePanda()};
  World world(scene, {{"panda", Panda()}});
  TestServo servo(&world, "panda");
  servo.MoveTo({Down(), {0.5, 0, 0.13}}, 1.0);
  servo.MoveTo({Down(), {0.5, 0, 0.03}}, 1.0);
  EXPECT_EQ(world.ContactForce("panda", "box"), 0);
  servo.Close(20);
  servo.Wait(0.6);
  EXPECT_NEAR(world.Observe().at("panda").gripper_opening, 0.05, 1e-3);
  EXPECT_NEAR(world.ContactForce("panda", "box"), 40, 2);
  const math::Pose X_HO = math::Between(servo.X_BH(), world.Truth().X_WO.at("box"));
  servo.MoveTo({Down(), {0.5, 0, 0.13}}, 1.0);
  servo.Wait(0.2);
  EXPECT_EQ(world.ContactForce("table", "box"), 0);
  // The payload, and nothing else, is what the arm feels: 0.1 kg at the hand.
  robot::State state(Panda());
  const robot::Observation seen = world.Observe().at("panda");
  state.Set(seen.q, seen.v);
  const Eigen::VectorXd payload = state.J_BH().topRows(3).transpose() * Eigen::Vector3d(0, 0, -0.981);
  EXPECT_LT((seen.tau_external - payload).norm(), 0.05) << seen.tau_external.transpose();
  servo.Wait(5);
  const Slip slip = SlipSince(X_HO, servo.X_BH(), world.Truth().X_WO.at("box"));
  EXPECT_NEAR(world.Truth().X_WO.at("box").p.z(), 0.125, 3e-3);
  EXPECT_LT(slip.distance, 0.002);
  EXPECT_LT(slip.angle, 0.02);
  servo.Open(0.08);
  servo.Wait(0.5);
  EXPECT_EQ(world.ContactForce("panda", "box"), 0);
  EXPECT_LT(world.Truth().X_WO.at("box").p.z(), 0.03);
}

TEST(GraspTest, FrictionHoldsARodNearItsEnd) {
  scene::Scene scene;
  // The handle lies along x, from 0.335 to 0.585 at y = 0.05.
  scene.objects = {MakeTable(), MakeHook({0.55, 0, 0.01})};
  scene.robots = {MakePanda()};
  World world(scene, {{"panda", Panda()}});
  TestServo servo(&world, "panda");
  const Eigen::Vector3d grasp(0.355, 0.05, 0.0145);
  const Eigen::Vector3d up(0, 0, 0.1);
  servo.MoveTo({Down(), grasp + up}, 1.0);
  servo.MoveTo({Down(), grasp}, 1.0);
  servo.Close(20);
  servo.Wait(0.6);
  const math::Pose X_HO = math::Between(servo.X_BH(), world.Truth().X_WO.at("hook"));
  servo.MoveTo({Down(), grasp + up}, 1.0);
  servo.Wait(5);
  const math::Pose X_HO_end = math::Between(servo.X_BH(), world.Truth().X_WO.at("hook"));
  const Slip slip = SlipSince(X_HO, servo.X_BH(), world.Truth().X_WO.at("hook"));
  // Where the hand holds it, the rod stays; it turns about the pads by no more than a degree or two.
  const Eigen::Vector3d held_before = X_HO.Inverse().p;
  const Eigen::Vector3d held_after = X_HO_end.Inverse().p;
  EXPECT_LT((held_after - held_before).norm(), 0.002);
  EXPECT_LT(slip.angle, 0.035);
}

}  // namespace
}  // namespace tether::sim
