// What is done to objects besides moving them.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/sim/test_scenes.h"
#include "tether/common/error.h"

namespace tether::sim {
namespace {

using Eigen::Vector3d;

class DisturbancesTest : public ::testing::Test {
 protected:
  DisturbancesTest() {
    scene_.objects = {MakeTable(), MakeObject("tall", geometry::Box{{0.04, 0.04, 0.2}}, {0.4, 0, 0.1}, 0.2),
                      MakeObject("box", geometry::Box{{0.05, 0.05, 0.05}}, {0.6, 0.2, 0.025}, 0.1)};
    world_ = std::make_unique<World>(scene_, std::map<std::string, std::shared_ptr<const robot::Model>>{});
    Run(0.3);
  }
  void Run(double duration) {
    const double end = world_->time() + duration;
    while (world_->time() < end - 1e-9) world_->Apply({}, 0.001);
  }
  math::Pose Pose(const std::string& name) const { return world_->Truth().X_WO.at(name); }

  scene::Scene scene_;
  std::unique_ptr<World> world_;
};

TEST_F(DisturbancesTest, WhatIsRemovedTouchesNothingUntilItIsBack) {
  world_->PlaceObject("box", math::Pose(Vector3d(0.4, 0, 0.225)));  // onto the tall one
  Run(1.5);
  ASSERT_GT(world_->ContactForce("box", "tall"), 0.5);
  world_->RemoveObject("tall");
  Run(0.6);
  EXPECT_TRUE(world_->IsRemoved("tall"));
  EXPECT_GT(Pose("tall").p.z(), 50);
  EXPECT_NEAR(Pose("box").p.z(), 0.025, 2e-3) << "what stood on it has fallen";
  world_->ReturnObject("tall", math::Pose(Vector3d(0.2, -0.3, 0.1)));
  Run(1);
  EXPECT_FALSE(world_->IsRemoved("tall"));
  EXPECT_LT((Pose("tall").p - Vector3d(0.2, -0.3, 0.1)).norm(), 2e-3);
}

TEST_F(DisturbancesTest, ABlowHighUpKnocksOverAndOneLowDownDoesNot) {
  world_->KnockObject("tall", {0.02, 0, 0}, {0, 0, 0});
  Run(1);
  EXPECT_GT(Pose("tall").R(2, 2), 0.99);
  world_->KnockObject("tall", {0.2, 0, 0}, {0, 0, 0.09});
  Run(1.5);
  EXPECT_LT(std::abs(Pose("tall").R(2, 2)), 0.1) << "it lies";
}

// The impulse is what it is said to be: m v.
TEST_F(DisturbancesTest, ABlowGivesItsImpulse) {
  world_->KnockObject("box", {0, 0, 0.1}, {0, 0, 0});
  Run(0.011);
  EXPECT_NEAR(world_->ObjectVelocity("box")[2], 0.1 / 0.1 - 0.011 * 9.81, 0.02);
}

TEST_F(DisturbancesTest, APullTakesAnObjectAlongAtItsSpeed) {
  const Vector3d from = Pose("box").p;
  world_->PullObject("box", {0, 0, 0.2}, 1.0, 20);
  Run(0.5);
  EXPECT_NEAR(world_->ObjectVelocity("box")[2], 0.2, 0.01);
  Run(0.5);
  EXPECT_NEAR((Pose("box").p - from).z(), 0.2, 0.01);
  Run(1);
  EXPECT_NEAR(Pose("box").p.z(), 0.025, 2e-3) << "then it is left alone";
  // Less than its weight lifts nothing.
  world_->PullObject("box", {0, 0, 0.2}, 1.0, 0.5);
  Run(1);
  EXPECT_NEAR(Pose("box").p.z(), 0.025, 2e-3);
}

TEST_F(DisturbancesTest, AnObjectMayBeAnotherInTruth) {
  world_->ChangeObject("box", {.mass = 1.0, .friction = {}, .grow = {}});
  Run(0.2);
  EXPECT_NEAR(world_->ContactForce("box", "table"), 9.81, 0.1);
  world_->ChangeObject("box", {.mass = {}, .friction = {}, .grow = 0.02});
  Run(0.5);
  EXPECT_NEAR(Pose("box").p.z(), 0.035, 2e-3) << "it is 7 cm high";
  EXPECT_NEAR(world_->ContactForce("box", "table"), 9.81, 0.1) << "and as heavy as before";
  world_->ChangeObject("box", {.mass = {}, .friction = 0.0, .grow = {}});
  world_->KnockObject("box", {0.1, 0, 0}, {0, 0, 0});
  Run(1);
  EXPECT_NEAR(world_->ObjectVelocity("box")[0], 0.1, 0.02) << "it slides without friction";
}

TEST_F(DisturbancesTest, WhatMakesNoSenseIsRefused) {
  EXPECT_THROW(world_->RemoveObject("table"), InputError);
  EXPECT_THROW(world_->RemoveObject("bix"), InputError);
  EXPECT_THROW(world_->KnockObject("box", {NAN, 0, 0}, {0, 0, 0}), InputError);
  EXPECT_THROW(world_->PullObject("box", {0, 0, 1}, 0, 20), InputError);
  EXPECT_THROW(world_->ChangeObject("box", {.mass = -1.0, .friction = {}, .grow = {}}), InputError);
}

}  // namespace
}  // namespace tether::sim
