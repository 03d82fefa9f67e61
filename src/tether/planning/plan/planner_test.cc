#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/planning/test_scene.h"
#include "tether/common/random.h"
#include "tether/planning/check/checker.h"
#include "tether/planning/plan/problem.h"
#include "tether/symbolic/pddl/pddl.h"

namespace tether::planning {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::shared_ptr<const symbolic::Task> ReachTask() {
  const std::string folder = std::string(TETHER_SOURCE_DIR) + "/scenarios/workspace_reach/";
  return symbolic::Task::Ground(symbolic::ReadProblem(folder + "domain.pddl", folder + "problem.pddl"));
}

Problem LimitedReachProblem() {
  Problem problem = ReachProblem();
  problem.search.max_actions = 5;
  return problem;
}

TEST(PlannerTest, WorkspaceReachHasThePapersThreeCandidates) {
  const Problem problem = LimitedReachProblem();
  const PlanReport report = PlanTask(problem, *ReachTask());
  EXPECT_EQ(report.status, PlanStatus::kSolved);
  EXPECT_TRUE(report.complete);
  ASSERT_EQ(report.candidates.size(), 3u);
  std::vector<std::string> third;
  for (const CandidateReport& candidate : report.candidates) {
    third.push_back(candidate.plan.actions.at(2));
    EXPECT_TRUE(candidate.feasible()) << candidate.reason;
    EXPECT_LE(candidate.max_violation_m, 1e-3);
    EXPECT_LE(candidate.max_violation_rad, 5e-3);
    // What the report says of a plan is what the checker says of it.
    EXPECT_EQ(CheckPlan(problem, candidate.plan).cost, candidate.plan.cost);
  }
  EXPECT_THAT(third,
              ::testing::UnorderedElementsAre("place(hook,table)", "place(hook,shelf)", "place(hook,box)"));
  EXPECT_EQ(report.best()->plan.actions.at(2), "place(hook,table)");
}

TEST(PlannerTest, AnyNumberOfThreadsGivesTheSameReport) {
  Problem problem = LimitedReachProblem();
  const auto task = ReachTask();
  const PlanReport one = PlanTask(problem, *task);
  problem.search.threads = 3;
  const PlanReport three = PlanTask(problem, *task);
  ASSERT_EQ(one.candidates.size(), three.candidates.size());
  for (size_t i = 0; i < one.candidates.size(); ++i) {
    EXPECT_EQ(one.candidates[i].plan.actions, three.candidates[i].plan.actions);
    EXPECT_EQ(one.candidates[i].plan.cost, three.candidates[i].plan.cost);
  }
}

TEST(PlannerTest, AProofPrunesEveryContinuation) {
  Problem problem = LimitedReachProblem();
  problem.search.max_actions = 9;
  problem.scene.objects[2].shape = geometry::Shape(geometry::Box{{0.09, 0.09, 0.05}});
  for (int threads : {1, 4}) {
    problem.search.threads = threads;
    const PlanReport report = PlanTask(problem, *ReachTask());
    EXPECT_EQ(report.status, PlanStatus::kImpossible) << report.message;
    // The proof is about every sequence that picks the box, and no other one reaches the goal.
    ASSERT_EQ(report.candidates.size(), 1u);
    for (const CandidateReport& candidate : report.candidates) {
      EXPECT_EQ(candidate.status, CandidateStatus::kInfeasible);
      EXPECT_THAT(candidate.reason, HasSubstr("box is 9.0 cm wide"));
    }
  }
}

TEST(PlannerTest, TooFewActionsIsGivingUp) {
  Problem problem = LimitedReachProblem();
  problem.search.max_actions = 3;
  const PlanReport report = PlanTask(problem, *ReachTask());
  EXPECT_EQ(report.status, PlanStatus::kGaveUp);
  EXPECT_THAT(report.message, HasSubstr("no sequence of up to 3 actions"));
}

TEST(PlannerTest, StopsWhenAsked) {
  Problem problem = LimitedReachProblem();
  std::atomic<bool> stop = true;
  problem.search.stop = &stop;
  const PlanReport report = PlanTask(problem, *ReachTask());
  EXPECT_EQ(report.status, PlanStatus::kInterrupted);
  EXPECT_FALSE(report.complete);
}

/// A feasible plan with few steps, to be spoiled for the checker.
class CheckerLawTest : public ::testing::Test {
 protected:
  CheckerLawTest() : problem_(LimitedReachProblem()) {
    problem_.search.max_plans = 1;
    plan_ = PlanTask(problem_, *ReachTask()).best()->plan;
  }
  CheckResult CheckWith(size_t step, const math::Pose& X_CD) const {
    Plan plan = plan_;
    plan.steps[step].X_TC = plan.steps[step].X_TC * X_CD;
    return CheckPlan(problem_, plan);
  }
  static std::vector<std::string> Labels(const CheckResult& result) {
    std::vector<std::string> labels;
    for (const CheckFinding& finding : result.findings)
      labels.push_back(finding.action + ": " + finding.label);
    return labels;
  }

  Problem problem_;
  Plan plan_;
};

TEST_F(CheckerLawTest, AcceptsThePlan) { EXPECT_TRUE(CheckPlan(problem_, plan_).Feasible(problem_.program)); }

TEST_F(CheckerLawTest, SeesAHandThatIsTilted) {
  const CheckResult result = CheckWith(0, math::Pose(math::ExpSO3({0.02, 0, 0}), {0, 0, 0}));
  EXPECT_NEAR(result.max_violation_rad, 0.02, 1e-6);
  EXPECT_THAT(Labels(result), ::testing::Contains("pick(hook): graspable(hook): approach from above"));
}

TEST_F(CheckerLawTest, SeesAToolThatDoesNotTouch) {
  const CheckResult result = CheckWith(1, math::Pose(Eigen::Vector3d(0.005, 0, 0)));
  EXPECT_NEAR(result.max_violation_m, 0.005, 1e-5);
  EXPECT_THAT(Labels(result), ::testing::Contains("push(hook,box,table): touch(hook, box)"));
}

TEST_F(CheckerLawTest, SeesAPushThatTurnsOrLifts) {
  EXPECT_THAT(Labels(CheckWith(2, math::Pose(math::ExpSO3({0, 0, 0.05}), {0, 0, 0}))),
              ::testing::Contains("push(hook,box,table): slide(box, table): without turning"));
  EXPECT_THAT(Labels(CheckWith(2, math::Pose(Eigen::Vector3d(0, 0, 0.01)))),
              ::testing::Contains("push(hook,box,table): slide(box, table): along the surface"));
}

TEST_F(CheckerLawTest, SeesWhatFloatsAndWhatIsUnsupported) {
  EXPECT_THAT(Labels(CheckWith(5, math::Pose(Eigen::Vector3d(0, 0, 0.004)))),
              ::testing::Contains("place(box,shelf): rests_on(box, shelf): touching"));
  EXPECT_THAT(Labels(CheckWith(5, math::Pose(Eigen::Vector3d(0.2, 0, 0)))),
              ::testing::Contains("place(box,shelf): supported(box, shelf)"));
}

TEST_F(CheckerLawTest, DoesNotDependOnWhereTheWorldIs) {
  const math::Pose X_VW(math::RotationFromRpy({0, 0, 0.7}), {0.3, -0.2, 0.1});
  Problem moved = problem_;
  for (scene::Object& object : moved.scene.objects) {
    if (object.parent == scene::kWorld) object.X_ParentObject = X_VW * object.X_ParentObject;
  }
  for (scene::Region& region : moved.scene.regions) region.X_ParentRegion = X_VW * region.X_ParentRegion;
  for (scene::Robot& robot : moved.scene.robots) robot.X_ParentBase = X_VW * robot.X_ParentBase;
  moved.robot.X_WBase = X_VW * moved.robot.X_WBase;
  moved.robot.X_WHand = X_VW * moved.robot.X_WHand;
  EXPECT_NEAR(CheckPlan(moved, plan_).cost, plan_.cost, 1e-9);
  EXPECT_NEAR(CheckPlan(moved, plan_).max_violation_m, CheckPlan(problem_, plan_).max_violation_m, 1e-9);
}

}  // namespace
}  // namespace tether::planning
