#include "tether/scenario/events/obstacle.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/scratch_folder.h"
#include "testing/scenario/test_scenarios.h"
#include "tether/bench/campaigns/campaign.h"
#include "tether/common/error.h"
#include "tether/common/file.h"
#include "tether/geometry/distance/distance.h"

namespace tether::bench {
namespace {

using Eigen::Vector3d;
using math::Pose;
using ::testing::HasSubstr;

TEST(ObstacleTest, AMovedOneLeavesTheTaskPossible) {
  const scenario::Scenario scenario = scenario::Shipped("assistive");
  for (uint64_t seed = 1; seed <= 30; ++seed) {
    const auto obstacle = scenario::DrawMovedObstacle(scenario, scenario.scene, 31, seed);
    ASSERT_TRUE(obstacle);
    EXPECT_GE(obstacle->event.time, 0);
    EXPECT_LE(obstacle->event.time, 155);
    const Pose& from = obstacle->object.X_ParentObject;
    EXPECT_GT(obstacle->event.X_by.p.norm(), 0.1);
    double nearest_place = 1;
    for (int k = 0; k <= 20; ++k) {
      const Pose X(from.R, from.p + obstacle->event.X_by.p * (k / 20.0));
      for (const scene::Region& region : scenario.scene.regions) {
        const Vector3d p = scenario.scene.InitialPose(region.name).p;
        const double gap =
            geometry::SignedDistance(obstacle->object.shape, X,
                                     geometry::Shape(geometry::Primitive(geometry::Sphere{1e-6})), Pose(p))
                .distance;
        // Open fingers reach 9 cm from the middle.
        EXPECT_GT(gap, region.hub ? 0.199 : 0.09) << region.name << ", seed " << seed;
        if (k == 20 && !region.hub) nearest_place = std::min(nearest_place, (X.p - p).head<2>().norm());
      }
      for (const scene::Object& object : scenario.scene.objects) {
        const double gap = geometry::SignedDistance(obstacle->object.shape, X, object.shape,
                                                    scenario.scene.InitialPose(object.name))
                               .distance;
        EXPECT_GT(gap, object.name == "table" ? 0 : 0.029) << object.name << ", seed " << seed;
      }
    }
    EXPECT_LT(nearest_place, 0.3);  // where it is an obstruction
  }
}

TEST(ObstacleTest, ACrossingOneGoesStraightAtItsSpeed) {
  const scenario::Scenario scenario = scenario::Shipped("assistive");
  double highest = 0;
  for (const scene::Object& object : scenario.scene.objects) {
    if (object.movable()) highest = std::max(highest, 2 * scenario.scene.InitialPose(object.name).p.z());
  }
  for (uint64_t seed = 1; seed <= 30; ++seed) {
    const auto obstacle = scenario::DrawCrossingObstacle(scenario, scenario.scene, 31, seed);
    ASSERT_TRUE(obstacle);
    const Vector3d by = obstacle->event.X_by.p, from = obstacle->object.X_ParentObject.p;
    EXPECT_NEAR(by.norm() / obstacle->event.over, 0.2, 1e-12);
    EXPECT_TRUE(obstacle->event.steady);
    EXPECT_EQ(by.z(), 0);
    EXPECT_GT(from.z(), highest + 0.04);
    EXPECT_GT(std::abs(from.x() * by.y() - from.y() * by.x()) / by.norm(), 0.3);  // past the base
    // Through the space in which the hand moves.
    const Vector3d middle = from + 0.5 * by;
    EXPECT_LT(middle.head<2>().norm(), 0.55);
  }
  const auto first = scenario::DrawCrossingObstacle(scenario, scenario.scene, 31, 4);
  const auto again = scenario::DrawCrossingObstacle(scenario, scenario.scene, 31, 4);
  EXPECT_EQ(first->event.time, again->event.time);
}

// Where no regions say what has to stay possible, it keeps away from everything that stands there.
TEST(ObstacleTest, ASceneWithoutRegionsHasOneToo) {
  const scenario::Scenario scenario = scenario::Shipped("stacking");
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const auto ball = scenario::DrawCrossingObstacle(scenario, scenario.scene, 4, seed);
    const auto post = scenario::DrawMovedObstacle(scenario, scenario.scene, 4, seed);
    ASSERT_TRUE(ball || post) << seed;
    for (const auto& obstacle : {ball, post}) {
      if (!obstacle) continue;
      for (const scene::Object& other : scenario.scene.objects) {
        if (!other.movable()) continue;
        EXPECT_GT(geometry::SignedDistance(obstacle->object.shape, obstacle->object.X_ParentObject,
                                           other.shape, scenario.scene.InitialPose(other.name))
                      .distance,
                  0.01)
            << seed << " " << other.name;
      }
    }
  }
}

TEST(ObstacleTest, EveryClearanceKeepsAwayFromIt) {
  scenario::Scenario scenario = scenario::Shipped("assistive");
  scene::Scene start = scenario.scene;
  const auto obstacle = scenario::DrawMovedObstacle(scenario, start, 31, 1);
  scenario::AddObstacle(*obstacle, start, scenario);
  EXPECT_NE(start.FindObject("obstacle"), nullptr);
  EXPECT_NE(scenario.scene.FindObject("obstacle"), nullptr);
  EXPECT_EQ(scenario.control_constraints[0].to.back(), "obstacle");
}

/// A cup that goes from one region to another.
const std::string kScene = R"yaml(format: tether.scenario/1
robots:
  jaco: {model: j2n6s300, q: [0.207, -0.062, 1.881, 0.378, -1.385, -1.592]}
objects:
  table: {shape: {box: [1.4, 1.8, 0.04]}, pose: {position: [0, 0, -0.02]}}
  cup: {shape: {box: [0.05, 0.04, 0.10]}, mass: 0.1, pose: {parent: left, position: [0, 0, 0.05]}}
regions:
  left: {disc: 0.06, capacity: 1, pose: {parent: table, position: [0.4, 0.25, 0.02]}}
  right: {rectangle: [0.12, 0.12], capacity: 1, pose: {parent: table, position: [0.4, -0.25, 0.02]}}
  hub: {sphere: 0.05, hub: true, pose: {position: [0.3, 0, 0.35]}}
task: {goal: {ltl: "F in(cup,right)"}}
actions: [regions]
constraints:
- clearance: {of: [links, held], to: [table, objects], distance: 0.01}
- tilt: {frame: hand, axis: z, from: [0, 0, -1], max: 0.35, relax: 1}
execution: {controller: constrained_velocity, rate: 200, gain: 1.0, damping: 0.001}
perturb: {position: 0.01, rotation: 0.08}
)yaml";

TEST(ControlCampaignTest, RunsReachTheirGoalAndKeepTheirDistance) {
  const ScratchFolder folder;
  CampaignOptions options;
  options.name = "control";
  options.scenario = folder.File("scenario.yaml");
  options.output = folder.File("runs.jsonl");
  options.scenes = 1;
  options.seed = 3;
  WriteFile(options.scenario, kScene);
  const CampaignResult result = RunCampaign(options);
  ASSERT_EQ(result.records.size(), 3u);
  for (const Value& record : result.records) {
    EXPECT_EQ(record.Find("run")->AsText(), "success") << WriteJson(record);
    // Evading what crosses may take what is held out of its cone: distances and speeds are kept first.
    const bool crossing = record.Find("kind")->AsText() == "crossing";
    for (const Value& margin : record.Find("margins")->items()) {
      const bool cone = margin.Find("name")->AsText().starts_with("cone");
      EXPECT_GE(margin.Find("minimum")->number(), crossing && cone ? -0.003 : 0) << WriteJson(margin);
    }
  }
  EXPECT_EQ(result.records[0].Find("obstacle"), nullptr);
  EXPECT_NE(result.records[1].Find("obstacle_margin_m"), nullptr);
  EXPECT_THAT(CampaignTable(SummarizeCampaign(options, result)),
              ::testing::AllOf(HasSubstr("crossing: 1 of 1 runs reach the goal"),
                               HasSubstr("least distance less the safe one")));
  // Read from the file: nothing is run again.
  EXPECT_EQ(RunCampaign(options).records.size(), 3u);
  options.scenario = folder.File("other.yaml");
  EXPECT_THROW(RunCampaign(options), InputError);
}

TEST(ControlCampaignTest, WhatSaysNothingToItIsRefused) {
  CampaignOptions options;
  options.name = "control";
  options.no_robot = true;
  options.kinds = {"reach"};
  try {
    RunCampaign(options);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::AllOf(HasSubstr("--no-robot has no effect"),
                                               HasSubstr("seeds, moved or crossing")));
  }
  options = {};
  options.name = "quality";
  options.scenario = "s.yaml";
  EXPECT_THROW(RunCampaign(options), InputError);
}

}  // namespace
}  // namespace tether::bench
