#include <cstdio>

#include <gtest/gtest.h>

#include "testing/evaluation/run_plan.h"
#include "testing/execution/test_plans.h"

namespace tether::execution {
namespace {

using Eigen::Vector3d;
using math::Pose;

const geometry::Shape kBlock = geometry::Primitive(geometry::Box{{0.045, 0.045, 0.045}});

/// Puts `b` onto `a` while `a` slides by `displacement` at one speed within `seconds`.
RunResult PlaceOnAMovingBlock(const Vector3d& displacement, double seconds, std::string* story) {
  scene::Scene scene = TableScene();
  scene.objects.push_back(MakeObject("a", kBlock, Pose(Vector3d(0.5, 0.1, 0.0225))));
  scene.objects.push_back(MakeObject("b", kBlock, Pose(Vector3d(0.5, 0.3, 0.0225))));
  const planning::Plan plan =
      PlanBuilder().Pick("b", TopGrasp({0, 0, 0})).Place("b", "a", Pose(Vector3d(0, 0, 0.045))).Build();
  bool moved = false;
  double next = 0;
  return RunPlan(scene, plan, [&](sim::World& world, const Executive& executive) {
    const Pose X_WA = world.Truth().X_WO.at("a");
    if (executive.step() >= 1 && !moved) {
      moved = true;
      world.MoveObject("a", Pose(X_WA.R, X_WA.p + displacement), seconds, true);
    }
    if (!moved || world.time() < next) return;
    next = world.time() + 0.1;
    const Vector3d d = world.Truth().X_WO.at("b").p - X_WA.p;
    char line[120];
    std::snprintf(line, sizeof line, "%.2f s: b at (%.1f, %.1f, %.1f) mm of a\n", world.time(), 1e3 * d.x(),
                  1e3 * d.y(), 1e3 * d.z());
    *story += line;
  });
}

// retreat_stays_in_the_world_frame: the fingers retreated in the world's frame and dragged `b` along.
TEST(MovingTargetSim, TheRetreatGoesAlongWithWhatWasTouched) {
  for (const Vector3d& displacement : {Vector3d(0, -0.3, 0), Vector3d(0.06, -0.2, 0), Vector3d(0.1, 0, 0)}) {
    std::string story;
    const RunResult run = PlaceOnAMovingBlock(displacement, 6.0, &story);
    ASSERT_EQ(run.status.state, ExecutiveStatus::State::kFinished) << run.Log();
    const Vector3d d = run.truth.X_WO.at("b").p - run.truth.X_WO.at("a").p;
    EXPECT_LT(d.head<2>().norm(), 0.004) << story << run.Log();
    EXPECT_NEAR(d.z(), 0.045, 0.002) << story << run.Log();
  }
}

}  // namespace
}  // namespace tether::execution
