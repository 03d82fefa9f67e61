#include <cmath>
#include <iostream>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/execution/execution_fixture.h"

namespace tether::execution {
namespace {

using math::Pose;

const geometry::Shape kCube = geometry::Primitive(geometry::Box{{0.05, 0.05, 0.05}});

scene::Scene OneBox() {
  scene::Scene scene = TableScene();
  scene.objects.push_back(MakeObject("box", kCube, Pose(Eigen::Vector3d(0.5, 0.15, 0.025))));
  return scene;
}

// The table's frame is 0.25 m below its top, half a metre in front of the robot.
Pose OnTable(double x, double y, double z, double yaw = 0) {
  return Pose(math::ExpSO3({0, 0, yaw}), {x - 0.5, y, z + 0.25});
}

planning::Plan PickAndPlace() {
  return PlanBuilder()
      .Pick("box", TopGrasp({0, 0, 0}))
      .Place("box", "table", OnTable(0.45, -0.2, 0.025, 0.5))
      .Build();
}

void ExpectAt(const RunResult& run, const std::string& object, const Eigen::Vector3d& p,
              double tolerance = 0.008) {
  EXPECT_LT((run.truth.X_WO.at(object).p - p).norm(), tolerance)
      << object << " at " << run.truth.X_WO.at(object).p.transpose() << "\n"
      << run.Log();
}

TEST(ExecutiveSim, PicksAndPlaces) {
  const RunResult run = RunPlan(OneBox(), PickAndPlace());
  EXPECT_EQ(run.status.state, ExecutiveStatus::State::kFinished) << run.Log();
  ExpectAt(run, "box", {0.45, -0.2, 0.025});
  std::cout << run.Log();
}

}  // namespace
}  // namespace tether::execution
