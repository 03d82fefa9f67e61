#include "tether/evaluation/check.h"

#include <variant>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/scratch_folder.h"
#include "testing/scenario/test_scenarios.h"
#include "tether/common/file.h"
#include "tether/common/version.h"
#include "tether/planning/plan/plan_file.h"
#include "tether/scenario/problem.h"

namespace tether::evaluation {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

scene::Object& Find(scenario::Scenario& scenario, const std::string& name) {
  return *const_cast<scene::Object*>(scenario.scene.FindObject(name));
}

TEST(CheckTest, ShippedScenariosAreConsistent) {
  for (const char* name : {"hanoi", "workspace_reach", "stacking", "tool_use", "parts"}) {
    EXPECT_THAT(CheckGeometry(scenario::Shipped(name)), ElementsAre()) << name;
  }
}

TEST(CheckTest, OverlapsGapsAndInitAreReported) {
  scenario::Scenario scenario = scenario::Shipped("hanoi");
  Find(scenario, "box_3").X_ParentObject.p.z() += 0.005;  // the authors' own mistake
  EXPECT_THAT(
      CheckGeometry(scenario),
      ElementsAre(HasSubstr("object 'box_3' rests on nothing: it is 5.0 mm from 'platform_right' below it"),
                  HasSubstr("(on box_3 platform_right) disagrees with the scene: they are 5.0 mm apart")));

  scenario = scenario::Shipped("workspace_reach");
  Find(scenario, "hook").X_ParentObject.p.z() -= 0.005;  // and the other one
  EXPECT_THAT(
      CheckGeometry(scenario),
      ElementsAre(
          HasSubstr("objects 'table' and 'hook' overlap by 5.0 mm"),
          HasSubstr("problem.pddl:12:5: (on hook table) disagrees with the scene: they overlap by 5.0 mm")));

  scenario = scenario::Shipped("workspace_reach");
  Find(scenario, "box").parent = scene::kWorld;
  Find(scenario, "box").X_ParentObject = math::Pose(Eigen::Vector3d(0.35, -0.35, 0.125));
  EXPECT_THAT(CheckGeometry(scenario),
              ElementsAre(HasSubstr("(on box table) disagrees with the scene: they are 100.0 mm"),
                          HasSubstr("object 'box' rests on 'shelf', but :init of ")));
}

class PlanCheckTest : public ::testing::Test {
 protected:
  void SetUp() override {
    scenario_ = scenario::Shipped("stacking");
    scenario::PlanningOverrides overrides;
    overrides.max_plans = 1;
    const planning::Problem problem = scenario::MakeProblem(scenario_, scenario_.scene, overrides);
    const planning::PlanReport report = planning::PlanTask(problem, *scenario::MakeTask(scenario_));
    ASSERT_NE(report.best(), nullptr) << report.message;
    plan_ = report.best()->plan;
  }

  std::vector<FileCheck> Check(const std::string& scenario_file) {
    WriteFile(file_, WriteJson(planning::WritePlan(plan_, {Version(), 3, scenario_file}, scenario_.scene,
                                                   scenario_.actions)));
    return CheckFiles({file_});
  }

  scenario::Scenario scenario_;
  planning::Plan plan_;
  ScratchFolder folder_;
  const std::string file_ = folder_.File("plan.json");
};

TEST_F(PlanCheckTest, AGoodPlanPassesAndABentOneDoesNot) {
  EXPECT_THAT(Check(scenario_.path)[0].problems, ElementsAre());
  EXPECT_EQ(Check(scenario_.path)[0].kind, "plan");
  plan_.steps[1].X_TC.p.z() += 0.004;
  EXPECT_THAT(Check(scenario_.path)[0].problems, ::testing::Contains(HasSubstr("place(blue,amber): ")));
}

TEST_F(PlanCheckTest, WhatRunRefusesIsAMistake) {
  const auto error = [&]() -> std::string {
    try {
      Check(scenario_.path);
    } catch (const InputError& mistake) {
      return mistake.what();
    }
    return "";
  };
  const planning::Plan whole = plan_;
  for (planning::Verb& verb : plan_.steps[0].execute) {
    auto* gripper = std::get_if<planning::GripperVerb>(&verb);
    if (gripper != nullptr && !gripper->close_on.empty()) gripper->close_on = "bleu";
  }
  EXPECT_THAT(error(), HasSubstr("the gripper closes on 'bleu', which is not an object ('blue'?"));
  EXPECT_THAT(error(), HasSubstr("plan.json: step 0 (pick(blue))"));
  plan_ = whole;
  plan_.steps[0].execute.clear();  // A step may have none; but then nothing is held.
  EXPECT_THAT(
      Check(scenario_.path)[0].problems,
      ElementsAre("pick(blue): its `execute` leaves the gripper as it is, but the action closes the gripper "
                  "on 'blue'"));
  plan_ = whole;
  plan_.steps[1].execute.pop_back();  // the retreat, which is not asked about
  plan_.steps[1].execute.pop_back();
  EXPECT_THAT(
      Check(scenario_.path)[0].problems,
      ElementsAre("place(blue,amber): its `execute` leaves the gripper as it is, but the action opens the "
                  "gripper"));
}

TEST_F(PlanCheckTest, ActionsMustBePossibleAndReachTheGoal) {
  planning::Plan whole = plan_;
  plan_.actions.resize(2);
  plan_.steps.resize(2);
  EXPECT_THAT(Check(scenario_.path)[0].problems,
              ::testing::Contains("the plan's actions do not reach the goal"));
}

TEST_F(PlanCheckTest, TheScenarioIsFoundOrAskedFor) {
  try {
    Check("nowhere.yaml");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("the scenario of this plan, 'Stacking' (nowhere.yaml), is not there"));
  }
  const std::vector<FileCheck> checks = CheckFiles({file_, scenario_.path});
  EXPECT_THAT(checks[0].problems, ElementsAre());
}

TEST(CheckTest, UnknownFormatsAreMistakes) {
  const ScratchFolder folder;
  const std::string file = folder.File("unknown.yaml");
  WriteFile(file, "format: tether.scenaro/1\n");
  try {
    CheckFiles({file, "missing.yaml"});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("1:9: unknown format 'tether.scenaro/1' (did you mean 'tether.scenario/1'?"));
    EXPECT_THAT(error.what(), HasSubstr("missing.yaml: cannot read this file"));
  }
}

}  // namespace
}  // namespace tether::evaluation
