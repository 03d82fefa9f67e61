// The shipped scenes, from file to judged goal.

#include <gtest/gtest.h>

#include "testing/evaluation/plan_and_run.h"
#include "testing/scenario/test_scenarios.h"
#include "tether/scenario/events.h"

namespace tether::evaluation {
namespace {

/// A shipped scene with the events of the scenario, or those of a file beside it.
PlannedRun RunShipped(const std::string& name, uint64_t seed, const std::string& events = "") {
  const scenario::Scenario scenario = scenario::Shipped(name);
  RunOptions options;
  options.seed = seed;
  options.events = scenario.events;
  if (!events.empty()) {
    options.events =
        scenario::ReadEvents(std::string(TETHER_SOURCE_DIR) + "/scenarios/" + name + "/" + events,
                             {&scenario.scene, &scenario.actions});
  }
  return PlanAndRun(scenario, options);
}

int Count(const RunReport& report, const std::string& kind) {
  int count = 0;
  for (const RunEvent& event : report.events) count += event.kind == kind ? 1 : 0;
  return count;
}

class ShippedScenes : public ::testing::TestWithParam<std::string> {};

TEST_P(ShippedScenes, ReachTheirGoalFromAPerturbedStart) {
  const PlannedRun outcome = RunShipped(GetParam(), 4);
  ASSERT_TRUE(outcome.planning.ok()) << outcome.planning.message;
  EXPECT_TRUE(outcome.planning.complete);
  for (const planning::CandidateReport& candidate : outcome.planning.candidates) {
    if (!candidate.feasible()) continue;
    EXPECT_LE(candidate.max_violation_m, 1e-3);
    EXPECT_LE(candidate.max_violation_rad, 5e-3);
  }
  EXPECT_EQ(outcome.run.status, RunStatus::kSuccess) << outcome.run.reason;
  EXPECT_TRUE(outcome.run.judgement.goal_reached);
  EXPECT_EQ(outcome.run.replans, 0);
}

INSTANTIATE_TEST_SUITE_P(Scenarios, ShippedScenes,
                         ::testing::Values("workspace_reach", "hanoi", "stacking", "tool_use", "parts",
                                           "press"));

TEST(VelocityScenes, KeepEveryConstraint) {
  const PlannedRun outcome = RunShipped("cups", 2);
  ASSERT_TRUE(outcome.planning.ok()) << outcome.planning.message;
  EXPECT_EQ(outcome.run.status, RunStatus::kSuccess) << outcome.run.reason;
  EXPECT_EQ(outcome.run.replans, 0);
  EXPECT_GT(outcome.run.margins.size(), 6u);
  for (const Margin& margin : outcome.run.margins) EXPECT_GE(margin.minimum, 0) << margin.name;
}

class Disturbances : public ::testing::TestWithParam<std::string> {};

TEST_P(Disturbances, AreFollowedWithoutANewPlan) {
  const PlannedRun outcome = RunShipped("workspace_reach", 2, GetParam());
  ASSERT_TRUE(outcome.planning.ok()) << outcome.planning.message;
  EXPECT_EQ(Count(outcome.run, "disturbance"), 1);
  EXPECT_EQ(outcome.run.status, RunStatus::kSuccess) << outcome.run.reason;
  EXPECT_EQ(outcome.run.replans, 0);
}

INSTANTIATE_TEST_SUITE_P(WorkspaceReach, Disturbances,
                         ::testing::Values("events_box_moved.yaml", "events_shelf_moved.yaml"));

/// The report without what the clock on the wall says.
std::string Timeless(RunReport report) {
  report.wall_s = 0;
  return WriteJson(WriteRunReport(report, "scene", 3));
}

TEST(ShippedScenesTest, TheSameSeedGivesTheSameReportBitForBit) {
  const std::string first = Timeless(RunShipped("stacking", 3).run);
  EXPECT_EQ(first, Timeless(RunShipped("stacking", 3).run));
}

}  // namespace
}  // namespace tether::evaluation
