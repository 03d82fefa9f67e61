#include "tether/task/search/replanner.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/scenario/test_scenarios.h"
#include "tether/planning/plan/problem.h"
#include "tether/scenario/problem.h"

namespace tether::scenario {
namespace {

using ::testing::HasSubstr;

class ReplannerTest : public ::testing::Test {
 protected:
  ReplannerTest() : scenario_(Shipped("assistive")), task_(MakeTask(scenario_)) {
    PlanningOverrides overrides;
    overrides.threads = 1;
    plan_ =
        planning::PlanTask(MakeProblem(scenario_, scenario_.scene, overrides), *task_).best()->plan.actions;
  }

  /// Whether the actions are applicable one after another, and reach the goal.
  bool ReachesGoal(const std::vector<std::string>& actions) const {
    task::Product product(task_, scenario_.goal);
    symbolic::State state = *product.Start(), next = state;
    for (const std::string& name : actions) {
      const ActionId action = task_->FindAction(name);
      if (!action.valid() || !task_->IsApplicable(action, state) || !product.Apply(action, state, next))
        return false;
      state = next;
    }
    return product.IsGoal(state);
  }

  Scenario scenario_;
  std::shared_ptr<const symbolic::Task> task_;
  std::vector<std::string> plan_;
};

TEST_F(ReplannerTest, WhatIsBlockedIsDoneWithoutOrLater) {
  ASSERT_TRUE(ReachesGoal(plan_));
  for (const size_t at : {size_t{0}, size_t{5}, size_t{12}, plan_.size() - 2}) {
    task::Replanner ways(task_, scenario_.goal);
    const std::vector<std::string> done(plan_.begin(), plan_.begin() + static_cast<std::ptrdiff_t>(at));
    std::string reason;
    const auto found = ways.Find(done, plan_[at], reason);
    ASSERT_TRUE(found) << plan_[at] << ": " << reason;
    EXPECT_NE(found->front(), plan_[at]);
    std::vector<std::string> whole = done;
    whole.insert(whole.end(), found->begin(), found->end());
    EXPECT_TRUE(ReachesGoal(whole)) << plan_[at];
  }
}

TEST_F(ReplannerTest, WhatIsBlockedTwiceIsNotTriedAgain) {
  task::Replanner ways(task_, scenario_.goal);
  const auto hold = std::find_if(plan_.begin(), plan_.end(), [](const std::string& action) {
    return action == "hold(pen,person_1)" || action == "hold(pen,person_2)";
  });
  ASSERT_NE(hold, plan_.end());
  const std::vector<std::string> done(plan_.begin(), hold);
  std::string reason;
  ASSERT_TRUE(ways.Find(done, *hold, reason));
  const auto found = ways.Find(done, *hold, reason);
  ASSERT_TRUE(found) << reason;
  EXPECT_EQ(std::count(found->begin(), found->end(), *hold), 0);
}

TEST_F(ReplannerTest, WithoutOtherActionsThereIsAReason) {
  // Heating is part of the goal, and there is one place for it.
  task::Replanner ways(task_, scenario_.goal);
  const auto hold = std::find(plan_.begin(), plan_.end(), "hold(meat,heat)");
  ASSERT_NE(hold, plan_.end());
  const std::vector<std::string> done(plan_.begin(), hold);
  std::string reason;
  ways.Find(done, *hold, reason);
  EXPECT_FALSE(ways.Find(done, *hold, reason));
  EXPECT_THAT(reason, HasSubstr("no other actions"));
}

}  // namespace
}  // namespace tether::scenario
