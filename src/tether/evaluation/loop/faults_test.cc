// What goes wrong with sensors, clocks and grippers while a plan runs, with both kinds of command: the arm is
// stopped within its limits, the report says why, and the run goes on, or fails with the cause, as the fault
// passes or lasts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/evaluation/plan_and_run.h"
#include "testing/scenario/test_scenarios.h"

namespace tether::evaluation {
namespace {

using Kind = robot::Fault::Kind;
using ::testing::HasSubstr;

struct Case {
  std::string name;
  robot::Fault fault;
  double time;        ///< s
  std::string says;   ///< The event, …
  bool stops = true;  ///< … whether the arm is stopped for it.
};

void PrintTo(const Case& given, std::ostream* out) { *out << given.name; }

RunReport RunWith(const std::string& scene, bool torques, const Case& given) {
  scenario::Event event;
  event.time = given.time;
  robot::Fault fault = given.fault;
  if (fault.robot == "arm") fault.robot = "panda";
  event.other = fault;
  RunOptions options;
  options.seed = 3;
  options.events = {event};
  scenario::Scenario scenario = scenario::Shipped(scene);
  if (!torques) {
    scenario.execution.controller = scenario::Controller::kConstrainedVelocity;
    scenario.execution.rate = 200;
  }
  return PlanAndRun(scenario, options).run;
}

const RunEvent* Find(const RunReport& run, const std::string& kind, const std::string& text) {
  for (const RunEvent& event : run.events) {
    if (event.kind == kind && event.text.find(text) != std::string::npos) return &event;
  }
  return nullptr;
}

std::string Story(const RunReport& run) {
  std::string text = run.reason + "\n";
  for (const RunEvent& event : run.events)
    text += std::to_string(event.time) + " " + event.kind + ": " + event.text + "\n";
  return text;
}

void ExpectWithinLimits(const RunReport& run) {
  for (const Margin& margin : run.margins) {
    const double least = margin.name.find("clearance") != std::string::npos ? -0.001 : 0;
    EXPECT_GE(margin.minimum, least) << margin.name << " at " << margin.time << " s: " << margin.what;
  }
}

std::vector<Case> Passing() {
  return {{"Silence", {Kind::kSilence, "arm", "", -1, 0, 0.3}, 3.2, "no measurement of"},
          {"LongSilence", {Kind::kSilence, "arm", "", -1, 0, 1.7}, 3.2, "no measurement of"},
          {"NotFinite", {Kind::kNotFinite, "arm", "", -1, 0, 0.2}, 3.2, "is not finite"},
          {"ClockAhead", {Kind::kClock, "arm", "", -1, 5, 1}, 3.2, "has jumped by 5.000 s"},
          {"ClockBack", {Kind::kClock, "arm", "", -1, -2, 1}, 3.2, "has jumped by -2.000 s"},
          {"EncoderGlitch",
           {Kind::kEncoder, "arm", "", 3, 0.3, 0.012},
           3.2,
           "seems to have jumped by 0.3",
           false},
          {"EncoderOff", {Kind::kEncoder, "arm", "", 1, -0.2, 0.4}, 3.2, "seems to have jumped by -0.2"},
          {"PosesSilent", {Kind::kSilence, "", "", -1, 0, 1}, 3, "no poses of objects come"},
          {"PoseClock", {Kind::kClock, "", "", -1, -3, 1}, 3.2, "the clock of the objects' poses"},
          {"Gripper", {Kind::kGripper, "arm", "", -1, 0, 2.5}, 1, "does not answer"}};
}

std::vector<Case> Lasting() {
  std::vector<Case> cases = Passing();
  std::erase_if(cases, [](const Case& one) { return one.fault.kind == Kind::kClock; });
  for (Case& one : cases) one.fault.over = 1e9;
  return cases;
}

struct Scene {
  std::string name;
  bool torques;
};
const Scene kTorques{"workspace_reach", true}, kVelocities{"stacking", false};

class Faults : public ::testing::TestWithParam<Case> {};

void ExpectRecovery(const Scene& scene, Case given) {
  // Velocities get to the first object later.
  if (given.name == "Gripper" && !scene.torques) given.time = 6.5;
  const RunReport run = RunWith(scene.name, scene.torques, given);
  EXPECT_EQ(run.status, RunStatus::kSuccess) << scene.name << Story(run);
  const RunEvent* fault = Find(run, "fault", given.says);
  ASSERT_NE(fault, nullptr) << Story(run);
  const bool stopped = Find(run, "fault", "the arm is stopped") || Find(run, "fault", "the arm waits");
  EXPECT_EQ(stopped, given.stops) << Story(run);
  const RunEvent* recovered = Find(run, "recovered", "");
  ASSERT_EQ(recovered != nullptr, given.stops) << Story(run);
  if (recovered) {
    EXPECT_GT(recovered->time, fault->time);
  }
  ExpectWithinLimits(run);
}

TEST_P(Faults, OnesThatPassAreRecoveredFromWithTorques) { ExpectRecovery(kTorques, GetParam()); }
TEST_P(Faults, OnesThatPassAreRecoveredFromWithVelocities) { ExpectRecovery(kVelocities, GetParam()); }

INSTANTIATE_TEST_SUITE_P(Kinds, Faults, ::testing::ValuesIn(Passing()),
                         [](const auto& given) { return given.param.name; });

class LastingFaults : public ::testing::TestWithParam<Case> {};

void ExpectFailure(const Scene& scene, const Case& given) {
  const RunReport run = RunWith(scene.name, scene.torques, given);
  EXPECT_EQ(run.status, RunStatus::kFailed) << scene.name;
  EXPECT_THAT(run.reason, HasSubstr(given.says)) << Story(run);
  EXPECT_THAT(run.reason, HasSubstr("for more than 2.0 s"));
  EXPECT_NE(Find(run, "fault", given.says), nullptr);
  ExpectWithinLimits(run);
}

TEST_P(LastingFaults, FailTheRunWithTheirCauseWithTorques) { ExpectFailure(kTorques, GetParam()); }
TEST_P(LastingFaults, FailTheRunWithTheirCauseWithVelocities) { ExpectFailure(kVelocities, GetParam()); }

INSTANTIATE_TEST_SUITE_P(Kinds, LastingFaults, ::testing::ValuesIn(Lasting()),
                         [](const auto& given) { return given.param.name; });

// The object that the present step is about.
TEST(FaultsTest, ATargetWithoutNumbersStopsTheArmAndFailsTheRun) {
  const Case given{
      "Target", {Kind::kNotFinite, "", "blue", -1, 0, 1e9}, 0.2, "the pose of 'blue' is not finite"};
  for (const double over : {1.5, 1e9}) {
    Case now = given;
    now.fault.over = over;
    const RunReport run = RunWith("stacking", true, now);
    EXPECT_NE(Find(run, "fault", given.says), nullptr) << Story(run);
    EXPECT_EQ(run.status, over > 2 ? RunStatus::kFailed : RunStatus::kSuccess) << Story(run);
    ExpectWithinLimits(run);
  }
}

}  // namespace
}  // namespace tether::evaluation
