// Temporal goals, things that vanish and goals that change while a plan runs: the plan is made anew, and the
// simulator's truth judges.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/evaluation/plan_and_run.h"
#include "testing/scenario/test_scenarios.h"
#include "tether/ltl/formula/parser.h"

namespace tether::evaluation {
namespace {

using Eigen::Vector3d;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;

scenario::Event Move(const std::string& object, const Vector3d& by) {
  scenario::Event event;
  event.object = object;
  event.X_by.p = by;
  event.over = 0.8;
  return event;
}

RunReport RunWith(const std::string& scene, std::vector<scenario::Event> events,
                  const std::string& goal = "") {
  RunOptions options;
  if (!goal.empty()) options.goal = task::TemporalGoal{ltl::ParseFormula(goal), ltl::Semantics::kLtlf, {}};
  options.seed = 3;
  options.events = std::move(events);
  return PlanAndRun(scenario::Shipped(scene), options).run;
}

std::string StoryOf(const RunReport& run) {
  std::string text = run.reason + "\n";
  for (const RunEvent& event : run.events) text += event.kind + " " + event.text + "\n";
  return text;
}

// In no region: it is grasped where it is.
TEST(TemporalLoopTest, AnObjectThatLiesInNoRegionIsFetchedAllTheSame) {
  scenario::Event event = Move("cup", {0.05, -0.17, 0});
  event.starts = "move(left)";
  const RunReport run = RunWith("cups", {event});
  EXPECT_EQ(run.status, RunStatus::kSuccess) << StoryOf(run);
  EXPECT_GE(run.replans, 1);
}

// What was on the tray and must stay there is brought back; that the cup was in the sink is not done again.
TEST(TemporalLoopTest, WhatWasUndoneIsDoneAgainAndNothingElse) {
  scenario::Event event = Move("cup", {0.22, -0.12, 0});
  event.ends = "place(cup,tray)";
  event.after = 0.1;
  const RunReport run =
      RunWith("cups", {event}, "F(in(cup,sink) & X[!] F in(cup,tray)) & F G(in(cup,tray) & in(jar,tray))");
  EXPECT_EQ(run.status, RunStatus::kSuccess) << StoryOf(run);
  int washed = 0;
  for (const RunEvent& one : run.events)
    washed += one.kind == "action_started" && one.text == "place(cup,sink)";
  EXPECT_EQ(washed, 1) << StoryOf(run);
}

TEST(TemporalLoopTest, AnObjectThatIsAwayForAWhileIsWaitedFor) {
  scenario::Event gone, back;
  gone.time = 1;
  gone.object = back.object = "denim";
  gone.other = scenario::Removal{};
  back.time = 14;
  back.other = scenario::Return{};
  const RunReport run = RunWith("stacking", {gone, back});
  EXPECT_EQ(run.status, RunStatus::kSuccess) << StoryOf(run);
  EXPECT_NE(RunWith("stacking", {gone}).status, RunStatus::kSuccess);
}

TEST(TemporalLoopTest, TheGoalMayChange) {
  scenario::Event event;
  event.time = 2;
  event.other = scenario::NewGoal{"(and (on denim coral) (on coral bench))", {}};
  const RunReport run = RunWith("stacking", {event});
  EXPECT_EQ(run.status, RunStatus::kSuccess) << StoryOf(run);
  EXPECT_THAT(run.judgement.facts, Contains(Field(&GoalFact::atom, "on(denim,coral)")));
}

TEST(TemporalLoopTest, WhatIsPulledFromTheHandIsGraspedAgain) {
  scenario::Event event;
  event.ends = "pick(blue)";
  event.after = 0.3;
  event.X_by.p = {0, 0, -0.06};
  event.over = 0.4;
  event.other = scenario::Pull{};
  const RunReport run = RunWith("stacking", {event});
  EXPECT_EQ(run.status, RunStatus::kSuccess) << StoryOf(run);
  EXPECT_THAT(StoryOf(run), HasSubstr("grasp_lost"));
}

TEST(TemporalLoopTest, WhatWasBrokenForGoodIsSaid) {
  scenario::Event event;
  event.object = "jar";
  event.starts = "move(left)";
  event.over = 2.5;
  event.has_goal = true;
  event.parent = "sink";
  event.X_ParentGoal.p = {0, 0, 0.0705};
  const RunReport run = RunWith("cups", {event});
  EXPECT_EQ(run.status, RunStatus::kGoalMissed) << StoryOf(run);
  EXPECT_THAT(StoryOf(run), HasSubstr("goal_broken G !in(jar,sink)"));
  EXPECT_THAT(run.judgement.facts, Contains(::testing::AllOf(Field(&GoalFact::atom, "in(jar,tray)"),
                                                             Field(&GoalFact::holds, true))));
  EXPECT_THAT(run.reason, HasSubstr("G !in(jar,sink)"));
}

}  // namespace
}  // namespace tether::evaluation
