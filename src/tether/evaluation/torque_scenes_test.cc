// The shipped scenes with constrained torques, judged by the simulator's truth.

#include <gtest/gtest.h>

#include "testing/evaluation/plan_and_run.h"
#include "testing/scenario/test_scenarios.h"
#include "tether/ltl/formula/parser.h"

namespace tether::evaluation {
namespace {

RunReport RunWithTorques(const std::string& name, uint64_t seed,
                         const std::vector<scenario::Event>& events = {}) {
  scenario::Scenario scenario = scenario::Shipped(name);
  scenario.execution.controller = scenario::Controller::kConstrainedTorque;
  RunOptions options;
  options.seed = seed;
  options.events = events;
  return PlanAndRun(scenario, options).run;
}

class TorqueScenes : public ::testing::TestWithParam<std::string> {};

TEST_P(TorqueScenes, ReachTheirGoalWithinAllLimits) {
  const RunReport run = RunWithTorques(GetParam(), 4);
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

/// Regions that are reached with torques: Panda and JACO.
struct Regions {
  std::string name, goal;
};

void PrintTo(const Regions& regions, std::ostream* out) { *out << regions.name; }

class TorqueRegions : public ::testing::TestWithParam<Regions> {};

// Cones and `upright` hold as they do with velocities, and so does everything else.
TEST_P(TorqueRegions, AreReachedWithinTheirCones) {
  scenario::Scenario scenario = scenario::Shipped(GetParam().name);
  scenario.goal = task::TemporalGoal{ltl::ParseFormula(GetParam().goal), ltl::Semantics::kCosafe, {}};
  scenario.execution = {};
  RunOptions options;
  options.seed = 4;
  const RunReport run = PlanAndRun(scenario, options).run;
  EXPECT_EQ(run.status, RunStatus::kSuccess) << run.reason;
  int cones = 0, upright = 0;
  for (const Margin& margin : run.margins) {
    cones += margin.name.starts_with("cone") ? 1 : 0;
    upright += margin.name.starts_with("upright") ? 1 : 0;
    EXPECT_GE(margin.minimum, -1e-6) << margin.name << " at " << margin.time << " s: " << margin.what;
  }
  EXPECT_GE(cones, 1);
  EXPECT_GE(upright, 1);
}

INSTANTIATE_TEST_SUITE_P(Scenarios, TorqueRegions,
                         ::testing::Values(Regions{"cups", "F in(jar, tray)"},
                                           Regions{"cups", "F in(cup, sink)"},
                                           Regions{"assistive", "F in(meat, heat)"}),
                         [](const auto& given) { return given.param.name + std::to_string(given.index); });

/// A disturbance of the stacking scene.
struct Disturbed {
  std::string name;
  uint64_t seed;
  std::string starts, object;
  Eigen::Vector3d by;  ///< Or, of an object that is put upon another one, in `parent`.
  std::string parent = {};
};

void PrintTo(const Disturbed& disturbed, std::ostream* out) { *out << disturbed.name; }

class TorqueFinds : public ::testing::TestWithParam<Disturbed> {};

// Whether the goal is reached is not the controller's to say; what it does meanwhile is: no limit of a joint
// is passed, nothing is pressed on that should not be touched, nothing is run into.
TEST_P(TorqueFinds, NothingIsExceededAndNothingIsPressed) {
  const Disturbed& given = GetParam();
  scenario::Event event;
  event.starts = given.starts;
  event.object = given.object;
  event.over = 1.2;
  event.parent = given.parent;
  event.has_goal = !given.parent.empty();
  event.X_by.p = event.X_ParentGoal.p = given.by;
  const RunReport run = RunWithTorques("stacking", given.seed, {event});
  int disturbances = 0;
  for (const RunEvent& happened : run.events) disturbances += happened.kind == "disturbance" ? 1 : 0;
  EXPECT_EQ(disturbances, 1);
  for (const Margin& margin : run.margins) {
    const double least = margin.name.find("clearance") != std::string::npos ? -0.001 : 0;
    EXPECT_GE(margin.minimum, least) << margin.name << " at " << margin.time << " s: " << margin.what;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Stacking, TorqueFinds,
    ::testing::Values(
        Disturbed{"TowerKnocked1287N", 1, "place(coral,blue)", "blue", {0.015, -0.0475, 0}},
        Disturbed{"TowerKnocked1287N_TheOtherWay", 2, "place(coral,blue)", "blue", {-0.05, 0.03, 0}},
        Disturbed{"FallenBlockPresses700N", 3, "place(blue,amber)", "denim", {0, 0, 0.06}, "amber"},
        Disturbed{"FallenBlockPresses700N_Another", 4, "pick(blue)", "coral", {0, 0.01, 0.06}, "amber"},
        Disturbed{"OverspeedOutOfReach", 1, "pick(blue)", "blue", {0.0042, 0.2, 0}},
        Disturbed{"OverspeedOutOfReach_Ahead", 5, "pick(coral)", "coral", {0.25, -0.05, 0}}),
    [](const auto& given) { return given.param.name; });

}  // namespace
}  // namespace tether::evaluation
