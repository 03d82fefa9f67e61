#include "tether/scenario/perturb.h"

#include <gtest/gtest.h>

#include "testing/scenario/test_scenarios.h"
#include "tether/geometry/distance/distance.h"
#include "tether/scene/resting_contact.h"

namespace tether::scenario {
namespace {

constexpr double kPosition = 0.01;
constexpr double kRotation = 0.0873;

TEST(PerturbTest, MovesMovableObjectsWithinTheBoundsAndNothingElse) {
  for (const char* name : {"workspace_reach", "tool_use", "stacking", "parts"}) {
    const Scenario scenario = Shipped(name);
    double farthest = 0, widest = 0;
    for (uint64_t seed = 0; seed < 100; ++seed) {
      const scene::Scene scene = PerturbScene(scenario.scene, {kPosition, kRotation}, seed);
      for (const scene::Object& object : scene.objects) {
        const math::Pose before = scenario.scene.InitialPose(object.name),
                         after = scene.InitialPose(object.name);
        const Eigen::Vector3d moved = after.p - before.p;
        const double angle = math::AngleBetween(before.R, after.R);
        if (!object.movable()) {
          EXPECT_EQ(moved.norm(), 0);
          EXPECT_EQ(angle, 0);
          continue;
        }
        EXPECT_NEAR(moved.z(), 0, 1e-12);
        EXPECT_LE(moved.norm(), kPosition + 1e-12);
        EXPECT_LE(angle, kRotation + 1e-9);
        farthest = std::max(farthest, moved.norm());
        widest = std::max(widest, angle);
      }
    }
    EXPECT_GT(farthest, 0.95 * kPosition) << name;
    EXPECT_GT(widest, 0.95 * kRotation) << name;
  }
}

TEST(PerturbTest, EverythingStaysOnWhatItStoodOn) {
  for (const char* name : {"hanoi", "workspace_reach", "tool_use", "stacking"}) {
    const Scenario scenario = Shipped(name);
    const auto before = scene::InitialPoses(scenario.scene);
    for (uint64_t seed = 0; seed < 50; ++seed) {
      const scene::Scene scene = PerturbScene(scenario.scene, scenario.perturb, seed);
      const auto after = scene::InitialPoses(scene);
      for (const scene::Object& object : scene.objects) {
        if (!object.movable()) continue;
        const scene::Object* was_on = scene::FindSupport(scenario.scene, before, object);
        ASSERT_NE(was_on, nullptr);
        const scene::Object& support = *scene.FindObject(was_on->name);
        EXPECT_TRUE(
            scene::FindResting(object, after.at(object.name), support, after.at(support.name)).Holds(1e-6))
            << name << " " << object.name << " seed " << seed;
        for (const scene::Object& other : scene.objects) {
          if (other.name == object.name) continue;
          EXPECT_GT(
              geometry::SignedDistance(object.shape, after.at(object.name), other.shape, after.at(other.name))
                  .distance,
              -1.5e-4);
        }
      }
    }
  }
}

TEST(PerturbTest, AStackMovesWithItsBase) {
  const Scenario scenario = Shipped("hanoi");
  double top = 0;
  for (uint64_t seed = 0; seed < 200; ++seed) {
    const scene::Scene scene = PerturbScene(scenario.scene, {kPosition, kRotation}, seed);
    // box_1 is displaced by at most its own displacement and those of the two blocks below it.
    const Eigen::Vector3d moved = scene.InitialPose("box_1").p - scenario.scene.InitialPose("box_1").p;
    EXPECT_LE(moved.norm(), 3 * kPosition + 1e-12);
    top = std::max(top, moved.norm());
    const math::Pose relative = math::Between(scene.InitialPose("box_2"), scene.InitialPose("box_1"));
    EXPECT_LE(relative.p.head<2>().norm(), kPosition + 1e-12);
  }
  EXPECT_GT(top, 1.2 * kPosition);
}

TEST(PerturbTest, SupportIsFoundByGeometryNotByParents) {
  // The same stack, with every pose given in the world.
  const Scenario scenario = Shipped("hanoi");
  scene::Scene flat = scenario.scene;
  for (scene::Object& object : flat.objects) {
    object.X_ParentObject = scenario.scene.InitialPose(object.name);
    object.parent = scene::kWorld;
  }
  const scene::Scene a = PerturbScene(scenario.scene, scenario.perturb, 4),
                     b = PerturbScene(flat, scenario.perturb, 4);
  for (const scene::Object& object : a.objects) {
    EXPECT_TRUE(a.InitialPose(object.name).p.isApprox(b.InitialPose(object.name).p, 1e-12)) << object.name;
  }
}

TEST(PerturbTest, TheSameSeedGivesTheSameScene) {
  const Scenario scenario = Shipped("stacking");
  const scene::Scene a = PerturbScene(scenario.scene, scenario.perturb, 7);
  const scene::Scene b = PerturbScene(scenario.scene, scenario.perturb, 7);
  const scene::Scene c = PerturbScene(scenario.scene, scenario.perturb, 8);
  EXPECT_EQ(a.InitialPose("coral").p, b.InitialPose("coral").p);
  EXPECT_EQ(a.InitialPose("coral").R, b.InitialPose("coral").R);
  EXPECT_NE(a.InitialPose("coral").p, c.InitialPose("coral").p);
  EXPECT_EQ(PerturbScene(scenario.scene, {}, 7).InitialPose("coral").p,
            scenario.scene.InitialPose("coral").p);
}

}  // namespace
}  // namespace tether::scenario
