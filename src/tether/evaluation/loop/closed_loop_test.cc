// What changes the state while a plan runs, on the shipped scenes: the plan is made anew, and the simulator's
// truth judges.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/evaluation/plan_and_run.h"
#include "testing/scenario/test_scenarios.h"

namespace tether::evaluation {
namespace {

using Eigen::Vector3d;

struct Change {
  std::string name;
  std::string scene;
  std::string starts;  ///< The action with which it begins, "ends …" at its end; empty: at `time`.
  double time = 0;     ///< s
  std::string object;
  Vector3d by;              ///< m, or …
  std::string parent = {};  ///< … the pose in this object.
  bool replans = true;      ///< Servoing alone does not answer it.
};

void PrintTo(const Change& change, std::ostream* out) { *out << change.name; }

RunReport RunWith(const Change& change, bool replan) {
  scenario::Event event;
  const bool ends = change.starts.starts_with("ends ");
  (ends ? event.ends : event.starts) = ends ? change.starts.substr(5) : change.starts;
  event.time = change.time;
  event.object = change.object;
  event.over = 0.6;
  event.has_goal = !change.parent.empty();
  event.parent = change.parent;
  (event.has_goal ? event.X_ParentGoal : event.X_by) = math::Pose(change.by);
  RunOptions options;
  options.seed = 3;
  options.replan = replan;
  options.events = {event};
  return PlanAndRun(scenario::Shipped(change.scene), options).run;
}

std::string ReplansOf(const RunReport& run) {
  std::string text;
  for (const RunEvent& event : run.events) {
    if (event.kind == "replanned" || event.kind == "resumed") text += event.text + "\n";
  }
  return text;
}

class ClosedLoop : public ::testing::TestWithParam<Change> {};

TEST_P(ClosedLoop, TheGoalIsReachedAllTheSame) {
  const RunReport run = RunWith(GetParam(), true);
  EXPECT_EQ(run.status, RunStatus::kSuccess) << run.reason << "\n" << ReplansOf(run);
  EXPECT_GE(run.replans, GetParam().replans ? 1 : 0);
  if (GetParam().replans) {
    EXPECT_NE(RunWith(GetParam(), false).status, RunStatus::kSuccess) << "without planning anew";
  }
}

INSTANTIATE_TEST_SUITE_P(
    Finds, ClosedLoop,
    ::testing::Values(
        Change{"UndoneEffectsAreNotNoticed", "stacking", "pick(denim)", 0, "coral", Vector3d(0.12, -0.06, 0)},
        Change{"PlacedBlockMovedUnnoticed", "stacking", "pick(coral)", 0, "blue", Vector3d(-0.04, 0.1, 0)},
        Change{"LastPlacedMovedAtTheEnd", "stacking", "ends place(denim,coral)", 0, "denim",
               Vector3d(-0.05, -0.15, -0.1)},
        Change{"AnotherObjectOnTop", "stacking", "pick(blue)", 0, "denim", Vector3d(0, 0, 0.05), "blue"}),
    [](const auto& test) { return test.param.name; });

// What is still falling when the plan is made anew may come to lie on another side: its grasp is planned
// again.
TEST(ClosedLoopTest, WhatFellOnAnotherSideIsGraspedAsItLies) {
  scenario::Event event;
  event.starts = "place(coral,blue)";
  event.object = "blue";
  event.X_by.p = {0.015, -0.0475, 0};
  event.over = 1.2;
  RunOptions options;
  options.seed = 1;
  options.events = {event};
  const RunReport run = PlanAndRun(scenario::Shipped("stacking"), options).run;
  EXPECT_EQ(run.status, RunStatus::kSuccess) << run.reason;
  EXPECT_EQ(run.retries, 0) << ReplansOf(run);
  bool said = false;
  for (const RunEvent& one : run.events)
    said = said || one.text.find("'blue' lies on another side") != std::string::npos;
  EXPECT_TRUE(said);
}

// A plan that goes as it should is never made anew.
TEST(ClosedLoopTest, NothingIsPlannedAnewWithoutNeed) {
  Change none{"None", "stacking", "never", 0, "denim", Vector3d::Zero()};
  const RunReport run = RunWith(none, true);
  EXPECT_EQ(run.status, RunStatus::kSuccess) << run.reason;
  EXPECT_EQ(run.replans, 0) << ReplansOf(run);
}

// The same run, event by event, whatever the planner's thread does meanwhile.
TEST(ClosedLoopTest, RunsAreReproducible) {
  const Change change{"Twice", "stacking", "pick(coral)", 0, "blue", Vector3d(-0.04, 0.1, 0)};
  const RunReport first = RunWith(change, true), second = RunWith(change, true);
  ASSERT_EQ(first.events.size(), second.events.size());
  for (size_t i = 0; i < first.events.size(); ++i) {
    EXPECT_EQ(first.events[i].time, second.events[i].time) << first.events[i].text;
    EXPECT_EQ(first.events[i].text, second.events[i].text);
  }
}

}  // namespace
}  // namespace tether::evaluation
