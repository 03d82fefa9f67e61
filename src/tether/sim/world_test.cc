#include "tether/sim/world.h"

#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/sim/test_scenes.h"
#include "tether/common/error.h"
#include "tether/common/random.h"
#include "tether/scene/friction.h"

namespace {
bool counting = false;
long allocations = 0;
}  // namespace

// Counts what the C++ side allocates; MuJoCo's own buffers are made once.
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (counting) ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace tether::sim {
namespace {

using testing::HasSubstr;

const Eigen::Vector3d kCube(0.05, 0.05, 0.05);

std::string ErrorOf(const auto& function) {
  try {
    function();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

math::Pose PoseOf(const World& world, const std::string& name) { return world.Truth().X_WO.at(name); }

void RunFor(World* world, double duration) {
  const double end = world->time() + duration;
  while (world->time() < end - 1e-9) world->Apply({}, 0.001);
}

TEST(WorldTest, FreeFallIsAParabola) {
  scene::Scene scene;
  scene.objects = {MakeObject("ball", geometry::Sphere{0.02}, {0, 0, 10}, 0.3)};
  World world(scene, {});
  RunFor(&world, 1.0);
  EXPECT_NEAR(PoseOf(world, "ball").p.z(), 10 - 9.81 / 2, 0.01);
  EXPECT_NEAR(world.ObjectVelocity("ball")[2], -9.81, 1e-6);
  EXPECT_NEAR(world.time(), 1.0, 1e-12);
}

TEST(WorldTest, ABoxOnATableStaysPut) {
  scene::Scene scene;
  scene.objects = {MakeTable(), MakeObject("box", geometry::Box{kCube}, {0.4, 0.1, 0.025}, 0.1)};
  World world(scene, {});
  RunFor(&world, 5.0);
  EXPECT_LT((PoseOf(world, "box").p - Eigen::Vector3d(0.4, 0.1, 0.025)).norm(), 1e-4);
  EXPECT_LT(math::AngleBetween(PoseOf(world, "box").R, Eigen::Matrix3d::Identity()), 1e-4);
  EXPECT_NEAR(world.ContactForce("box", "table"), 0.981, 1e-3);
  EXPECT_LT(world.ObjectVelocity("box").norm(), 1e-4);
}

// A board on 66 posts has 264 contacts, more than there is room for at first.
TEST(WorldTest, RoomForContactsGrows) {
  scene::Scene scene;
  for (int i = 0; i < 11; ++i) {
    for (int j = 0; j < 6; ++j) {
      scene.objects.push_back(MakeObject("post_" + std::to_string(i) + "_" + std::to_string(j),
                                         geometry::Box{{0.02, 0.02, 0.1}},
                                         {0.1 * (i - 5), 0.1 * (j - 2.5), 0.05}));
    }
  }
  scene.objects.push_back(MakeObject("board", geometry::Box{{1.2, 0.7, 0.02}}, {0, 0, 0.11}, 2));
  World world(scene, {});
  RunFor(&world, 1.0);
  EXPECT_LT((PoseOf(world, "board").p - Eigen::Vector3d(0, 0, 0.11)).norm(), 1e-4);
  EXPECT_LT(math::AngleBetween(PoseOf(world, "board").R, Eigen::Matrix3d::Identity()), 1e-4);
  for (const char* post : {"post_0_0", "post_10_5"}) EXPECT_GT(world.ContactForce("board", post), 0.05);
}

// On an inclined plane Coulomb's law decides: it holds below atan(friction) and slides above.
TEST(WorldTest, FrictionIsCoulombs) {
  for (const double slope : {0.35, 0.42}) {
    scene::Scene scene;
    const Eigen::Matrix3d R = math::RotationFromRpy({0, slope, 0});
    for (auto object : {MakeObject("plane", geometry::Box{{2, 1, 0.1}}, R * Eigen::Vector3d(0, 0, -0.05)),
                        MakeObject("box", geometry::Box{kCube}, R * Eigen::Vector3d(0, 0, 0.025), 0.1)}) {
      object.friction = 0.4;  // atan(0.4) = 0.38
      object.X_ParentObject.R = R;
      scene.objects.push_back(object);
    }
    World world(scene, {});
    RunFor(&world, 1.0);
    const double slid = (PoseOf(world, "box").p - R * Eigen::Vector3d(0, 0, 0.025)).norm();
    if (slope < 0.38) {
      EXPECT_LT(slid, 1e-3);
    } else {
      const double acceleration = 9.81 * (std::sin(slope) - 0.4 * std::cos(slope));
      EXPECT_NEAR(slid, acceleration / 2, 0.1 * acceleration);
    }
  }
}

// find friction_max: whichever of the two surfaces is the slippery one, and whatever the other is.
TEST(WorldTest, WhatHasNoFrictionSlidesOnEverything) {
  for (const auto& [box_friction, plane_friction] :
       {std::pair{0.0, 0.8}, {0.8, 0.0}, {0.8, 0.8}, {0.4, 1.2}}) {
    scene::Scene scene;
    const Eigen::Matrix3d R = math::RotationFromRpy({0, 0.3, 0});
    for (auto object : {MakeObject("plane", geometry::Box{{4, 1, 0.1}}, R * Eigen::Vector3d(0, 0, -0.05)),
                        MakeObject("box", geometry::Box{kCube}, R * Eigen::Vector3d(0, 0, 0.025), 0.1)}) {
      object.friction = object.movable() ? box_friction : plane_friction;
      object.X_ParentObject.R = R;
      scene.objects.push_back(object);
    }
    World world(scene, {});
    RunFor(&world, 1.0);
    const double slid = (PoseOf(world, "box").p - R * Eigen::Vector3d(0, 0, 0.025)).norm();
    const double friction = scene::PairFriction(box_friction, plane_friction);
    const double acceleration = 9.81 * (std::sin(0.3) - friction * std::cos(0.3));
    EXPECT_NEAR(slid, std::max(0.0, acceleration / 2), 0.1 * std::max(0.01, acceleration))
        << box_friction << " on " << plane_friction;
  }
}

TEST(WorldTest, ACompoundBalancesAboutItsOneCentreOfMass) {
  // A dumb-bell with a big and a small end on a narrow post: it stays only if the post is under its centre of
  // mass.
  const geometry::Shape shape(std::vector<geometry::Part>{
      {geometry::Box{{0.1, 0.1, 0.02}}, math::Pose(Eigen::Vector3d(-0.1, 0, 0))},
      {geometry::Box{{0.2, 0.05, 0.02}}, math::Pose(Eigen::Vector3d(0.05, 0, 0))}});
  const double centre = geometry::CentreOfMass(shape).x();
  for (const double offset : {0.0, 0.02, -0.02}) {
    scene::Scene scene;
    scene.objects = {MakeObject("post", geometry::Box{{0.03, 0.03, 0.2}}, {centre + offset, 0, 0.1}),
                     MakeObject("bell", shape, {0, 0, 0.21}, 0.2)};
    World world(scene, {});
    RunFor(&world, 1.0);
    EXPECT_EQ(PoseOf(world, "bell").p.z() > 0.205, offset == 0.0) << offset;
  }
}

TEST(WorldTest, AnArmWithoutCommandsFloatsWhereItIs) {
  scene::Scene scene;
  scene.objects = {MakeTable()};
  scene.robots = {MakePanda()};
  World world(scene, {{"panda", Panda()}});
  RunFor(&world, 1.0);
  const robot::Observation seen = world.Observe().at("panda");
  EXPECT_LT((seen.q - Panda()->home()).norm(), 1e-3);
  EXPECT_LT(seen.tau_external.norm(), 1e-6);
  EXPECT_NEAR(seen.gripper_opening, 0.08, 1e-4);
}

TEST(WorldTest, EndStopsAreNotExternalTorque) {
  scene::Scene scene;
  scene.robots = {MakePanda()};
  World world(scene, {{"panda", Panda()}});
  robot::State state(Panda());
  robot::Commands commands;
  commands["panda"].gripper.opening = 0.04;
  for (int i = 0; i < 4000; ++i) {
    const robot::Observation seen = world.Observe().at("panda");
    state.Set(seen.q, seen.v);
    commands["panda"].torque = state.bias() - 5 * seen.v;
    commands["panda"].torque[6] += 5;  // Against the end stop of the last joint.
    world.Apply(commands, 0.001);
  }
  const robot::Observation seen = world.Observe().at("panda");
  EXPECT_NEAR(seen.q[6], Panda()->upper()[6], 0.02);
  EXPECT_LT(seen.tau_external.norm(), 1e-6) << seen.tau_external.transpose();
  EXPECT_NEAR(seen.gripper_opening, 0.04, 1e-3);
}

scene::Scene BusyScene() {
  scene::Scene scene;
  scene.objects = {MakeTable()};
  for (int i = 0; i < 5; ++i) {
    scene.objects.push_back(MakeObject("box_" + std::to_string(i), geometry::Box{kCube},
                                       {0.4 + 0.1 * i, 0.3, 0.025 + 0.001 * i}, 0.1));
  }
  scene.robots = {MakePanda()};
  return scene;
}

TEST(WorldTest, TheSameCommandsGiveTheSameMotionBitForBit) {
  std::vector<double> runs[2];
  for (std::vector<double>& run : runs) {
    World world(BusyScene(), {{"panda", Panda()}});
    Random random(7);
    robot::Commands commands;
    commands["panda"].torque = Eigen::VectorXd::Zero(7);
    for (int i = 0; i < 1000; ++i) {
      for (int j = 0; j < 7; ++j) commands["panda"].torque[j] = random.Uniform(-20, 20);
      world.Apply(commands, 0.001);
      if (i == 300) world.MoveObject("table", math::Pose(Eigen::Vector3d(0.52, 0.02, -0.25)), 0.5);
    }
    for (const auto& [name, X] : world.Truth().X_WO) {
      run.insert(run.end(), X.p.data(), X.p.data() + 3);
      run.insert(run.end(), X.R.data(), X.R.data() + 9);
    }
    const robot::Observation seen = world.Observe().at("panda");
    run.insert(run.end(), seen.q.data(), seen.q.data() + 7);
  }
  EXPECT_EQ(runs[0], runs[1]);
}

TEST(WorldTest, SteppingAllocatesNothing) {
  World world(BusyScene(), {{"panda", Panda()}});
  world.MoveObject("table", math::Pose(Eigen::Vector3d(0.52, 0.02, -0.25)), 10);
  robot::Commands commands;
  commands["panda"].torque = Eigen::VectorXd::Zero(7);
  robot::Observations seen = world.Observe();
  scene::WorldEstimate truth = world.Truth();
  allocations = 0;
  counting = true;
  for (int i = 0; i < 200; ++i) {
    world.Observe(&seen);
    world.Truth(&truth);
    world.Apply(commands, 0.001);
  }
  counting = false;
  EXPECT_EQ(allocations, 0);
}

TEST(WorldTest, PeriodsAndStepsDoNotDriftApart) {
  scene::Scene scene;
  scene.objects = {MakeTable()};
  WorldOptions options;
  options.timestep = 0.002;
  World world(scene, {}, options);
  for (int i = 0; i < 300; ++i) world.Apply({}, 0.005);
  EXPECT_NEAR(world.time(), 1.5, 0.0011);
}

TEST(WorldTest, TwoArmsKeepApart) {
  scene::Scene scene;
  scene.robots = {MakePanda(), MakePanda()};
  scene.robots[1].name = "other";
  scene.robots[1].X_ParentBase = math::Pose(math::RotationFromRpy({0, 0, M_PI}), Eigen::Vector3d(1.2, 0, 0));
  World world(scene, {{"panda", Panda()}, {"other", Panda()}});
  TestServo servo(&world, "other");
  servo.MoveTo({Down(), {0.5, 0.1, 0.3}}, 1.0);
  servo.Wait(0.5);
  EXPECT_LT((servo.X_BH().p - Eigen::Vector3d(0.5, 0.1, 0.3)).norm(), 2e-3);
  EXPECT_LT((world.Observe().at("panda").q - Panda()->home()).norm(), 1e-3);
  EXPECT_EQ(world.ContactForce("panda", "other"), 0);
}

TEST(WorldTest, MistakesAreExplained) {
  World world(BusyScene(), {{"panda", Panda()}});
  EXPECT_THAT(ErrorOf([&] { world.PlaceObject("bix_1", {}); }), HasSubstr("did you mean 'box_1'?"));
  EXPECT_THAT(ErrorOf([&] { world.MoveObject("box_1", {}, 0); }), HasSubstr("nothing teleports"));
  EXPECT_THAT(ErrorOf([&] { (void)world.ContactForce("box_1", "pandas"); }), HasSubstr("no object 'pandas'"));
  robot::Commands commands;
  commands["panda"].torque = Eigen::VectorXd::Zero(6);
  EXPECT_THAT(ErrorOf([&] { world.Apply(commands, 0.001); }), HasSubstr("wrong size or not finite"));
  commands["panda"].torque = Eigen::VectorXd::Constant(7, std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(ErrorOf([&] { world.Apply(commands, 0.001); }), HasSubstr("not finite"));
  commands.clear();
  commands["pandora"];
  EXPECT_THAT(ErrorOf([&] { world.Apply(commands, 0.001); }), HasSubstr("did you mean 'panda'?"));
  scene::Scene scene = BusyScene();
  scene.robots[0].q = {0, 0, 0, 0, 0, 0, 0};
  EXPECT_THAT(ErrorOf([&] { World(scene, {{"panda", Panda()}}); }), HasSubstr("joint4 at 0"));
  scene.robots[0].q = {0, 0};
  EXPECT_THAT(ErrorOf([&] { World(scene, {{"panda", Panda()}}); }), HasSubstr("has 2 joint positions"));
}

}  // namespace
}  // namespace tether::sim
