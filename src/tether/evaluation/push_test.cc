#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "testing/evaluation/run_plan.h"
#include "testing/execution/test_plans.h"
#include "tether/math/so3.h"

namespace tether::execution {
namespace {

using math::Pose;

/// A hook made of two boxes, with the head at the same place as that of HookShape().
geometry::Shape BoxHookShape() {
  return geometry::Shape({{geometry::Box{{0.25, 0.02, 0.02}}, Pose(Eigen::Vector3d(-0.09, 0.05, 0))},
                          {geometry::Box{{0.02, 0.12, 0.02}}, Pose(Eigen::Vector3d(0.035, 0, 0))}});
}

struct PushCase {
  double friction = 0.8;  ///< Of box, hook and table.
  double mass = 0.1;      ///< Of the box, kg
  bool boxes = false;     ///< The hook is made of boxes.
  double aside = 0;       ///< How far the push leads to the side, m.
  uint64_t seed = 1;
};

struct PushResult {
  double position = 1, angle = 1;  ///< How far the box is from its pose, m and rad.
  int retries = 0;
  std::string log;
};

PushResult Push(const PushCase& push) {
  Random random(push.seed);
  scene::Scene scene = TableScene();
  scene.objects.push_back(MakeObject("box", geometry::Primitive(geometry::Box{{0.05, 0.05, 0.05}}),
                                     Pose(Eigen::Vector3d(0.9, 0, 0.025)), push.mass));
  scene.objects.push_back(
      MakeObject("hook", push.boxes ? BoxHookShape() : HookShape(), Pose(Eigen::Vector3d(0.9, 0.3, 0.01))));
  for (scene::Object& object : scene.objects) object.friction = push.friction;
  Perturb(&scene, &random);
  // It is not turned: its pose has the box's own angle.
  Pose X_TableGoal = math::Between(scene.InitialPose("table"), scene.InitialPose("box"));
  const Eigen::Vector3d u = X_TableGoal.R.col(0), side = X_TableGoal.R.col(1);
  X_TableGoal.p += -random.Uniform(0.15, 0.23) * u + push.aside * side;
  const Pose X_BoxHook(Eigen::Vector3d(0, 0, -0.011));
  const planning::Plan plan = PlanBuilder()
                                  .Pick("hook", TopGrasp({-0.195, 0.05, 0.0045}))
                                  .Push("hook", "box", "table", X_BoxHook, X_TableGoal)
                                  .Build();
  const RunResult run = RunPlan(scene, plan);
  PushResult result;
  result.retries = run.retries;
  result.log = run.Log();
  if (run.status.state != ExecutiveStatus::State::kFinished) return result;
  const Pose X_WGoal = scene.InitialPose("table") * X_TableGoal;
  result.position = (run.truth.X_WO.at("box").p - X_WGoal.p).norm();
  result.angle = math::AngleBetween(run.truth.X_WO.at("box").R, X_WGoal.R);
  return result;
}

constexpr double kNear = 0.003;                             // m
constexpr double kTurned = 1.0 * std::numbers::pi / 180.0;  // rad

// push_drift_then_blind_retries: a pushed box ended 12 to 17 mm from its pose, mostly to the side.
TEST(PushSim, EndsWhereTheObjectIsToBe) {
  for (const PushCase& push : {PushCase{0.8, 0.1, false, 0.03, 1}, PushCase{0.8, 0.1, true, 0.03, 2},
                               PushCase{0.3, 0.05, false, 0.01, 3}, PushCase{1.0, 1.0, true, -0.03, 4},
                               PushCase{0.3, 1.0, true, 0.01, 5}, PushCase{1.0, 1.0, false, 0.035, 1001},
                               PushCase{1.0, 0.05, false, -0.03, 6}}) {
    const PushResult result = Push(push);
    EXPECT_LE(result.position, kNear) << push.friction << " " << push.mass << "\n" << result.log;
    EXPECT_LE(result.angle, kTurned) << push.friction << " " << push.mass << "\n" << result.log;
    EXPECT_EQ(result.retries, 0) << result.log;
  }
}

// A stranger's: a round body was pushed again and again because it had turned about its axis, which means
// nothing. It may also be wanted turned by any angle.
TEST(PushSim, TheTurnOfARoundBodyMeansNothing) {
  for (const double yaw : {0.0, 1.2}) {
    scene::Scene scene = TableScene();
    scene.objects.push_back(MakeObject("can", geometry::Primitive(geometry::Cylinder{0.03, 0.06}),
                                       Pose(Eigen::Vector3d(0.9, 0, 0.03)), 0.1));
    scene.objects.push_back(MakeObject("hook", BoxHookShape(), Pose(Eigen::Vector3d(0.9, 0.3, 0.01))));
    const Pose X_TableGoal(math::ExpSO3({0, 0, yaw}), Eigen::Vector3d(0.2, 0, 0.28));
    const planning::Plan plan =
        PlanBuilder()
            .Pick("hook", TopGrasp({-0.195, 0.05, 0.0045}))
            .Push("hook", "can", "table", Pose(Eigen::Vector3d(0, 0, -0.016)), X_TableGoal)
            .Build();
    const RunResult run = RunPlan(scene, plan);
    EXPECT_EQ(run.status.state, ExecutiveStatus::State::kFinished) << run.Log();
    EXPECT_EQ(run.retries, 0) << run.Log();
    const Eigen::Vector3d goal = (scene.InitialPose("table") * X_TableGoal).p;
    EXPECT_LE((run.truth.X_WO.at("can").p - goal).norm(), 0.006) << run.Log();
  }
}

// push_drift_then_blind_retries: the hook was set down on the box, three times in the same place. An object
// is put down beside what stands at its place.
TEST(PushSim, WhatIsPutDownGoesBesideWhatStandsThere) {
  for (const double y : {0.0, 0.12}) {
    scene::Scene scene = TableScene();
    const geometry::Shape cube = geometry::Primitive(geometry::Box{{0.05, 0.05, 0.05}});
    scene.objects.push_back(MakeObject("box", cube, Pose(Eigen::Vector3d(0.5, 0.2, 0.025))));
    scene.objects.push_back(MakeObject("other", cube, Pose(Eigen::Vector3d(0.5, -0.2, 0.025))));
    const planning::Plan plan = PlanBuilder()
                                    .Pick("box", TopGrasp({0, 0, 0}))
                                    .Place("box", "table", Pose(Eigen::Vector3d(0.04, -0.2 + y, 0.275)))
                                    .Build();
    const RunResult run = RunPlan(scene, plan);
    EXPECT_EQ(run.status.state, ExecutiveStatus::State::kFinished) << run.Log();
    EXPECT_EQ(run.retries, 0) << run.Log();
    const Eigen::Vector3d p = run.truth.X_WO.at("box").p;
    EXPECT_NEAR(p.z(), 0.025, 0.002) << run.Log();
    EXPECT_LT((p - Eigen::Vector3d(0.54, -0.2 + y, 0.025)).norm(), y > 0 ? 0.004 : 0.06) << run.Log();
    EXPECT_LT((run.truth.X_WO.at("other").p - Eigen::Vector3d(0.5, -0.2, 0.025)).norm(), 0.002);
  }
}

// Frictions and masses with both hooks: the corners of the grid, or with TETHER_WHOLE_GRID=1 all of it, five
// seeds each, which takes minutes and prints the table of docs/benchmarks.md.
TEST(PushSim, GridOfFrictionsAndMasses) {
  const bool whole = std::getenv("TETHER_WHOLE_GRID") != nullptr;
  const std::vector<double> frictions = whole ? std::vector{0.3, 0.5, 0.75, 1.0} : std::vector{0.3, 1.0};
  const std::vector<double> masses = whole ? std::vector{0.05, 0.1, 0.3, 1.0} : std::vector{0.05, 1.0};
  const uint64_t last = whole ? 1005 : 1001;
  int all = 0, good = 0;
  double worst = 0, worst_angle = 0;
  for (const double friction : frictions) {
    for (const double mass : masses) {
      for (const bool boxes : {false, true}) {
        int near = 0;
        double far = 0, turned = 0;
        std::string text;
        for (uint64_t seed = 1001; seed <= last; ++seed) {
          // As steep as a plan would have it: within a quarter of the friction angle.
          const double aside = 0.19 * std::tan(0.25 * std::atan(friction)) * (seed % 2 == 0 ? 1 : -1);
          const PushResult result = Push({friction, mass, boxes, aside, seed});
          const bool there = result.position <= kNear && result.angle <= kTurned;
          near += there;
          far = std::max(far, result.position);
          turned = std::max(turned, result.angle);
          if (!there) text += result.log;
        }
        all += static_cast<int>(last - 1000);
        good += near;
        worst = std::max(worst, far);
        worst_angle = std::max(worst_angle, turned);
        std::printf("friction %.2f mass %.2f %-8s %d there, at most %.1f mm %.2f degrees\n%s", friction, mass,
                    boxes ? "boxes" : "capsules", near, 1e3 * far, turned * 180 / std::numbers::pi,
                    text.c_str());
        std::fflush(stdout);
      }
    }
  }
  std::printf("%d of %d, at most %.1f mm and %.2f degrees\n", good, all, 1e3 * worst,
              worst_angle * 180 / std::numbers::pi);
  EXPECT_EQ(good, all);
}

}  // namespace
}  // namespace tether::execution
