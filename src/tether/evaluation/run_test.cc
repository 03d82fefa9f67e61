#include "tether/evaluation/run.h"

#include <gtest/gtest.h>

#include "testing/scenario/test_scenarios.h"
#include "tether/scenario/perturb.h"
#include "tether/scenario/problem.h"

namespace tether::evaluation {
namespace {

struct Prepared {
  scenario::Scenario scenario;
  std::shared_ptr<const symbolic::Task> task;
  planning::Plan plan;
};

/// Only the first block of the stacking scene: one pick and one place.
Prepared OneBlock() {
  Prepared prepared;
  prepared.scenario = scenario::Shipped("stacking");
  prepared.scenario.problem = symbolic::WithGoal(*prepared.scenario.problem, "(on blue amber)", {});
  prepared.task = scenario::MakeTask(prepared.scenario);
  scenario::PlanningOverrides overrides;
  overrides.max_plans = 1;
  overrides.max_actions = 2;
  const planning::Problem problem =
      scenario::MakeProblem(prepared.scenario, prepared.scenario.scene, overrides);
  const planning::PlanReport report = planning::PlanTask(problem, *prepared.task);
  if (report.best() != nullptr) prepared.plan = report.best()->plan;
  return prepared;
}

TEST(RunTest, OnePickAndPlaceReachesTheGoalBitForBitTheSame) {
  const Prepared prepared = OneBlock();
  ASSERT_EQ(prepared.plan.actions.size(), 2u);
  RunOptions options;
  options.seed = 2;
  const scene::Scene scene =
      scenario::PerturbScene(prepared.scenario.scene, prepared.scenario.perturb, options.seed);
  const RunReport first = RunPlan(prepared.scenario, scene, *prepared.task, prepared.plan, options);
  EXPECT_EQ(first.status, RunStatus::kSuccess) << first.reason;
  const RunReport second = RunPlan(prepared.scenario, scene, *prepared.task, prepared.plan, options);
  ASSERT_EQ(first.events.size(), second.events.size());
  EXPECT_EQ(first.sim_time_s, second.sim_time_s);
  for (size_t i = 0; i < first.events.size(); ++i) {
    EXPECT_EQ(first.events[i].time, second.events[i].time);
    EXPECT_EQ(first.events[i].text, second.events[i].text);
  }
}

TEST(RunTest, DisturbancesHappenOnceWhenTheirActionStarts) {
  Prepared prepared = OneBlock();
  RunOptions options;
  scenario::Event away;
  away.starts = "pick(blue)";
  away.object = "blue";
  away.X_by.p = {-0.05, 0, 0};
  away.over = 1.0;
  scenario::Event later;
  later.time = 0.25;
  later.object = "denim";
  later.X_by.p = {0, -0.03, 0};
  options.events = {away, later};
  const RunReport report =
      RunPlan(prepared.scenario, prepared.scenario.scene, *prepared.task, prepared.plan, options);
  std::vector<double> times;
  for (const RunEvent& event : report.events) {
    if (event.kind == "disturbance") times.push_back(event.time);
  }
  ASSERT_EQ(times.size(), 2u);
  EXPECT_NEAR(times[0], 0, 0.002);
  EXPECT_NEAR(times[1], 0.25, 0.002);
  EXPECT_EQ(report.status, RunStatus::kSuccess) << report.reason;
}

// goal_reached_but_failed: an event may bring the goal about; the plan was not carried out nevertheless.
TEST(RunTest, WhatIsNotCarriedOutIsNoSuccessThoughTheGoalHolds) {
  Prepared prepared = OneBlock();
  prepared.scenario.execution.timeout_s = 1.0;
  RunOptions options;
  scenario::Event lifted;
  lifted.object = "blue";
  const math::Pose amber = prepared.scenario.scene.InitialPose("amber");
  lifted.X_by.p = amber.p - prepared.scenario.scene.InitialPose("blue").p + Eigen::Vector3d(0, 0, 0.3);
  lifted.over = 0.3;
  scenario::Event put;
  put.time = 0.4;
  put.object = "blue";
  put.has_goal = true;
  put.parent = "amber";
  put.X_ParentGoal.p = {0, 0, 0.0605};
  put.over = 0.4;
  options.events = {lifted, put};
  const RunReport report =
      RunPlan(prepared.scenario, prepared.scenario.scene, *prepared.task, prepared.plan, options);
  EXPECT_EQ(report.status, RunStatus::kTimeout) << report.reason;
  EXPECT_FALSE(report.ok());
  EXPECT_TRUE(report.judgement.goal_reached);
}

// event_never_fires: an event whose moment never came was silently left out.
TEST(RunTest, EventsThatNeverHappenAreSaid) {
  Prepared prepared = OneBlock();
  RunOptions options;
  scenario::Event never;
  never.starts = "pick(denim)";
  never.object = "denim";
  never.X_by.p = {0, -0.03, 0};
  scenario::Event late = never;
  late.starts.clear();
  late.time = 500;
  options.events = {never, late};
  const RunReport report =
      RunPlan(prepared.scenario, prepared.scenario.scene, *prepared.task, prepared.plan, options);
  EXPECT_EQ(report.status, RunStatus::kSuccess) << report.reason;
  std::vector<std::string> texts;
  for (const RunEvent& event : report.events) {
    EXPECT_NE(event.kind, "disturbance");
    if (event.kind == "never_happened") texts.push_back(event.text);
  }
  ASSERT_EQ(texts.size(), 2u);
  EXPECT_EQ(texts[0], "move denim by (0, -0.03, 0) m over 1 s: 'pick(denim)' never started");
  EXPECT_EQ(texts[1], "move denim by (0, -0.03, 0) m over 1 s: the run ended before 500.00 s");
}

// A run said what held, not where things are.
TEST(RunTest, ReportsSayWhereThingsEnd) {
  const Prepared prepared = OneBlock();
  const RunReport report =
      RunPlan(prepared.scenario, prepared.scenario.scene, *prepared.task, prepared.plan, {});
  ASSERT_EQ(report.status, RunStatus::kSuccess) << report.reason;
  const Value written = WriteRunReport(report, "one block", 1);
  const Value* poses = written.Find("final_poses");
  ASSERT_NE(poses, nullptr);
  ASSERT_EQ(poses->members().size(), prepared.scenario.scene.objects.size());
  bool moved = false;
  for (const scene::Object& object : prepared.scenario.scene.objects) {
    const Value* pose = poses->Find(object.name);
    ASSERT_NE(pose, nullptr) << object.name;
    EXPECT_EQ(pose->Find("quaternion_wxyz")->items().size(), 4u);
    Eigen::Vector3d p;
    for (size_t i = 0; i < 3; ++i)
      p[static_cast<Eigen::Index>(i)] = pose->Find("position")->items()[i].number();
    const double from_start = (p - prepared.scenario.scene.InitialPose(object.name).p).norm();
    if (!object.movable()) {
      EXPECT_LT(from_start, 1e-9) << object.name;
    }
    moved = moved || from_start > 0.02;
  }
  EXPECT_TRUE(moved);
}

TEST(RunTest, TimeoutsAndInterruptionsAreOutcomes) {
  Prepared prepared = OneBlock();
  prepared.scenario.execution.timeout_s = 0.05;
  const RunReport late =
      RunPlan(prepared.scenario, prepared.scenario.scene, *prepared.task, prepared.plan, {});
  EXPECT_EQ(late.status, RunStatus::kTimeout);
  EXPECT_FALSE(late.judgement.goal_reached);
  const std::atomic<bool> stop{true};
  RunOptions options;
  options.stop = &stop;
  const RunReport stopped =
      RunPlan(prepared.scenario, prepared.scenario.scene, *prepared.task, prepared.plan, options);
  EXPECT_EQ(stopped.status, RunStatus::kInterrupted);
  EXPECT_EQ(stopped.sim_time_s, 0);
}

TEST(RunTest, WhatTheControllerCannotDoIsBadInput) {
  Prepared prepared = OneBlock();
  prepared.scenario.execution.controller = scenario::Controller::kConstrainedVelocity;
  prepared.scenario.execution.gain = -1;
  EXPECT_THROW(RunPlan(prepared.scenario, prepared.scenario.scene, *prepared.task, prepared.plan, {}),
               InputError);
  prepared.scenario.execution.controller = scenario::Controller::kOperationalSpace;
  prepared.scenario.execution.gain = 0;
  EXPECT_THROW(RunPlan(prepared.scenario, prepared.scenario.scene, *prepared.task, prepared.plan, {}),
               InputError);
}

TEST(RunTest, TheReportHasTheDocumentedKeys) {
  Prepared prepared = OneBlock();
  prepared.scenario.execution.timeout_s = 0.05;
  const RunReport report =
      RunPlan(prepared.scenario, prepared.scenario.scene, *prepared.task, prepared.plan, {});
  const Value value = WriteRunReport(report, "Stacking", 3);
  EXPECT_EQ(value.members()[0].key, "format");
  EXPECT_EQ(value.members()[2].key, "seed");
  for (const char* key : {"status", "goal_reached", "sim_time_s", "steps", "replans", "events"}) {
    EXPECT_NE(value.Find(key), nullptr) << key;
  }
  EXPECT_EQ(value.Find("steps")->items().size(), prepared.plan.steps.size());
}

}  // namespace
}  // namespace tether::evaluation
