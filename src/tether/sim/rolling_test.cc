#include "tether/sim/rolling.h"

#include <cmath>

#include <gtest/gtest.h>

#include "testing/sim/test_scenes.h"
#include "tether/sim/world.h"

namespace tether::sim {
namespace {

using Eigen::Vector3d;
using math::Pose;

const Pose kLying(math::RotationFromRpy({0, M_PI / 2, 0}), Vector3d::Zero());

struct Lying {
  const char* name;
  geometry::Shape shape;
  double radius;
};

/// Tins, a capsule, a ball and a bottle, that lie along x.
std::vector<Lying> LyingThings() {
  const Pose neck(Vector3d(0, 0, 0.06));
  return {{"thin tin", geometry::Primitive(geometry::Cylinder{0.008, 0.1}), 0.008},
          {"tin", geometry::Primitive(geometry::Cylinder{0.022, 0.11}), 0.022},
          {"wide tin", geometry::Primitive(geometry::Cylinder{0.05, 0.06}), 0.05},
          {"capsule", geometry::Primitive(geometry::Capsule{0.02, 0.08}), 0.02},
          {"ball", geometry::Primitive(geometry::Sphere{0.03}), 0.03},
          {"bottle",
           geometry::Shape(std::vector<geometry::Part>{{geometry::Cylinder{0.03, 0.08}, Pose()},
                                                       {geometry::Cylinder{0.012, 0.06}, neck}}),
           0.03}};
}

World Yard(const Lying& lying, double yaw, double slope, double table_friction, double mass) {
  scene::Scene scene;
  const Eigen::Matrix3d R = math::RotationFromRpy({slope, 0, 0});
  scene::Object table = MakeObject("table", geometry::Box{{4, 4, 0.1}}, R * Vector3d(0, 0, -0.05));
  table.X_ParentObject.R = R;
  table.friction = table_friction;
  scene::Object object = MakeObject("thing", lying.shape, R * Vector3d(0, 0, lying.radius), mass);
  object.X_ParentObject.R = R * math::RotationFromRpy({0, 0, yaw}) * kLying.R;
  scene.objects = {table, object};
  return World(scene, {});
}

void RunFor(World* world, double duration) {
  const double end = world->time() + duration;
  while (world->time() < end - 1e-9) world->Apply({}, 0.001);
}

// Lying cylinders set off by themselves: by 4 cm in 5 s, and they trembled with 7 mm/s.
TEST(RollingTest, WhatLiesOnLevelGroundLiesStill) {
  for (const Lying& lying : LyingThings()) {
    for (const double yaw : {0.0, 0.3, 1.2}) {
      for (const double table_friction : {0.3, 0.8, 1.0}) {
        World world = Yard(lying, yaw, 0, table_friction, 0.1);
        RunFor(&world, 3);
        EXPECT_LT(world.Truth().X_WO.at("thing").p.head<2>().norm(), 3e-4) << lying.name << table_friction;
        EXPECT_LT(world.ObjectVelocity("thing").head<3>().norm(), 1e-3) << lying.name << table_friction;
      }
    }
  }
}

// A solid cylinder that resists rolling with an arm b rolls with (2/3) g (sin a − cos a · b/r).
TEST(RollingTest, SlopesAreRolledDown) {
  const Lying tin = LyingThings()[1];
  for (const double slope : {0.008, 0.05, 0.1}) {
    World world = Yard(tin, 0, slope, 0.8, 0.1);
    RunFor(&world, 1);
    const double way = world.Truth().X_WO.at("thing").p.head<2>().norm();
    const double a = 2.0 / 3 * 9.81 * (std::sin(slope) - std::cos(slope) * 3e-4 / tin.radius);
    EXPECT_NEAR(way, std::max(0.0, 0.5 * a), 0.1 * std::max(0.01, 0.5 * a)) << slope;
  }
}

TEST(RollingTest, WhatIsRoundAboutOneAxisRolls) {
  using geometry::Part;
  const auto shape = [](const std::vector<Part>& parts) { return geometry::Shape(parts); };
  const geometry::Cylinder tin{0.03, 0.1};
  const geometry::Sphere ball{0.03};
  EXPECT_TRUE(Rolls(shape({{tin, Pose()}})));
  EXPECT_TRUE(Rolls(shape({{ball, Pose()}, {ball, Pose(Vector3d(0.1, 0.1, 0))}})));
  EXPECT_TRUE(Rolls(shape({{ball, Pose(Vector3d(0, 0, 0.1))}, {tin, Pose()}})));
  EXPECT_FALSE(Rolls(shape({{ball, Pose(Vector3d(0, 0.01, 0.1))}, {tin, Pose()}})));
  EXPECT_FALSE(Rolls(shape({{tin, Pose()}, {tin, kLying}})));
  EXPECT_FALSE(Rolls(shape({{tin, Pose()}, {geometry::Box{{0.1, 0.1, 0.1}}, Pose()}})));
  EXPECT_FALSE(Rolls(MakeHook(Vector3d::Zero()).shape));
}

}  // namespace
}  // namespace tether::sim
