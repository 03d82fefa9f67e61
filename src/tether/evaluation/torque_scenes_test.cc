// The shipped scenes with constrained torques, judged by the simulator's truth.

#include <gtest/gtest.h>

#include "testing/scenario/test_scenarios.h"
#include "tether/evaluation/run.h"
#include "tether/scenario/perturb.h"
#include "tether/scenario/problem.h"

namespace tether::evaluation {
namespace {

RunReport PlanAndRun(const std::string& name, uint64_t seed) {
  scenario::Scenario scenario = scenario::Shipped(name);
  scenario.execution.controller = "constrained_torque";
  const auto task = scenario::MakeTask(scenario);
  const scene::Scene scene = scenario::PerturbScene(scenario.scene, scenario.perturb, seed);
  scenario::PlanningOverrides overrides;
  overrides.seed = seed;
  const planning::PlanReport report =
      planning::PlanTask(scenario::MakeProblem(scenario, scene, overrides), *task);
  if (report.best() == nullptr) return {};
  RunOptions options;
  options.seed = seed;
  return RunPlan(scenario, scene, *task, report.best()->plan, options);
}

class TorqueScenes : public ::testing::TestWithParam<std::string> {};

TEST_P(TorqueScenes, ReachTheirGoalWithinAllLimits) {
  const RunReport run = PlanAndRun(GetParam(), 4);
  EXPECT_EQ(run.status, RunStatus::kSuccess) << run.reason;
  EXPECT_GT(run.margins.size(), 6u);
  bool torque_rate = false, force = false, velocity = false;
  for (const Margin& margin : run.margins) {
    EXPECT_GE(margin.minimum, 0) << margin.name << " at " << margin.time << " s: " << margin.what;
    torque_rate = torque_rate || margin.name.find("torque rate") != std::string::npos;
    force = force || margin.name.find("force") != std::string::npos;
    velocity = velocity || margin.name.find("velocity") != std::string::npos;
  }
  EXPECT_TRUE(torque_rate && force && velocity);
}

INSTANTIATE_TEST_SUITE_P(Scenarios, TorqueScenes,
                         ::testing::Values("workspace_reach", "hanoi", "stacking", "tool_use", "parts"));

}  // namespace
}  // namespace tether::evaluation
