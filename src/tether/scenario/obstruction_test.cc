// Find nothing_is_moved_aside: what leaves no room for an action is put elsewhere first.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/scenario/test_scenarios.h"
#include "tether/planning/plan/problem.h"
#include "tether/scenario/problem.h"

namespace tether::scenario {
namespace {

using Eigen::Vector3d;

/// The stacking scene with blue so long that the hand can close on it across y only, and neighbours there.
planning::PlanReport PlanWithNeighbours(bool both) {
  Scenario scenario = Shipped("stacking");
  const auto put = [&](const char* name, const Vector3d& size, const Vector3d& p) {
    for (scene::Object& object : scenario.scene.objects) {
      if (object.name != name) continue;
      object.shape = geometry::Primitive(geometry::Box{size});
      object.X_ParentObject = math::Pose(p);
    }
  };
  put("blue", {0.085, 0.045, 0.045}, {0.5, 0.2, 0.0225});
  put("coral", {0.075, 0.05, 0.05}, {0.5, 0.2475, 0.025});
  if (both) put("denim", {0.075, 0.05, 0.05}, {0.5, 0.1525, 0.025});
  scenario.problem = symbolic::WithGoal(*scenario.problem, "(on blue amber)", {});
  return planning::PlanTask(MakeProblem(scenario, scenario.scene, {}), *MakeTask(scenario));
}

TEST(ObstructionTest, NothingIsMovedAside_OneBesideIt) {
  const planning::PlanReport report = PlanWithNeighbours(false);
  ASSERT_NE(report.best(), nullptr) << report.message;
  const std::vector<std::string>& actions = report.best()->plan.actions;
  ASSERT_EQ(actions.size(), 4u);
  EXPECT_EQ(actions[0], "pick(coral)");
  EXPECT_EQ(actions[2], "pick(blue)");
}

TEST(ObstructionTest, NothingIsMovedAside_OneOnEachSide) {
  const planning::PlanReport report = PlanWithNeighbours(true);
  ASSERT_NE(report.best(), nullptr) << report.message;
  const std::vector<std::string>& actions = report.best()->plan.actions;
  EXPECT_GE(actions.size(), 4u);
  EXPECT_EQ(actions[actions.size() - 2], "pick(blue)");
}

}  // namespace
}  // namespace tether::scenario
