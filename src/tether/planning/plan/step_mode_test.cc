#include "tether/planning/plan/step_mode.h"

#include <gtest/gtest.h>

#include "tether/planning/plan/plan.h"

namespace tether::planning {
namespace {

PlanStep Step(const std::string& control, const std::string& target, std::vector<Verb> verbs) {
  PlanStep step;
  step.control = control;
  step.target = target;
  step.execute = std::move(verbs);
  return step;
}

TEST(StepMode, FollowsFromWhatTheHandHolds) {
  Plan plan;
  plan.steps = {Step("hand", "hook", {ReachVerb{}, GripperVerb{"hook", 20}}),
                Step("hook", "box", {ReachVerb{}}),
                Step("box", "table", {ReachVerb{}}),
                Step("hook", "table", {ReachVerb{}, GripperVerb{}}),
                Step("hand", "box", {ReachVerb{}}),
                Step("box", "shelf", {ReachVerb{}}),
                Step("hand", "goal", {ReachVerb{}})};
  plan.steps[1].X_TC.p.x() = 0.1;
  plan.steps[4].X_TC.p.x() = 0.2;
  plan.steps[6].target_is_region = true;
  SetModes(&plan);
  const StepMode modes[] = {StepMode::kGrasp, StepMode::kFree, StepMode::kPush,  StepMode::kPlace,
                            StepMode::kFree,  StepMode::kPush, StepMode::kRegion};
  const std::string held[] = {"", "hook", "hook", "hook", "", "", ""};
  for (size_t i = 0; i < plan.steps.size(); ++i) {
    EXPECT_EQ(plan.steps[i].mode, modes[i]) << i;
    EXPECT_EQ(plan.steps[i].held, held[i]) << i;
    EXPECT_EQ(plan.steps[i].grasp_step, held[i].empty() ? -1 : 0) << i;
  }
  EXPECT_EQ(plan.steps[2].tool, "hook");
  EXPECT_EQ(plan.steps[2].X_CTool->p.x(), 0.1);
  EXPECT_EQ(plan.steps[5].tool, "hand");
  EXPECT_EQ(plan.steps[5].X_CTool->p.x(), 0.2);
}

TEST(StepMode, NobodyPushesWhatNothingWasBroughtTo) {
  Plan plan;
  plan.steps = {Step("box", "table", {ReachVerb{}})};
  SetModes(&plan);
  EXPECT_EQ(plan.steps[0].mode, StepMode::kPush);
  EXPECT_FALSE(plan.steps[0].X_CTool);
}

TEST(StepMode, NamesAreThoseOfFiles) {
  for (const std::string& name : StepModeNames()) EXPECT_EQ(ToString(*FindStepMode(name)), name);
  EXPECT_FALSE(FindStepMode("pull"));
}

}  // namespace
}  // namespace tether::planning
