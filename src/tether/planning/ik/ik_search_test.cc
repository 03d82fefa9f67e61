#include "tether/planning/ik/ik_search.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/scratch_folder.h"
#include "testing/planning/test_scene.h"
#include "tether/common/document/value.h"
#include "tether/common/file.h"
#include "tether/geometry/distance/distance.h"
#include "tether/planning/check/checker.h"
#include "tether/planning/ik/ik_rows.h"
#include "tether/planning/plan/candidate.h"

namespace tether::planning {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::HasSubstr;

CandidateReport Optimize(const Problem& problem, const std::vector<std::string>& actions) {
  return OptimizeCandidate(SceneFacts(problem), actions, 0, Limits(problem.search)).report;
}

scene::Object Box(const std::string& name, const Vector3d& size, const Vector3d& p, bool movable) {
  scene::Object object;
  object.name = name;
  object.shape = geometry::Shape(geometry::Box{size});
  object.X_ParentObject = math::Pose(p);
  if (movable) object.mass = 0.1;
  return object;
}

/// A bench whose top is at z = 0, in front of the arm, and what stands on it.
Problem BenchProblem(std::vector<scene::Object> things) {
  scene::Scene scene;
  scene.objects.push_back(Box("bench", {2, 2, 0.4}, {0.5, 0, -0.2}, false));
  for (scene::Object& thing : things) scene.objects.push_back(std::move(thing));
  scene.robots.push_back({"panda", "panda", {0, -0.5236, 0, -2.6180, 0, 2.0944, 0}, "world", {}});
  Problem problem = PandaProblem(std::move(scene));
  return problem;
}

const std::vector<std::string> kHookPlan{"pick(hook)", "push(hook,box,table)", "place(hook,table)",
                                         "pick(box)", "place(box,shelf)"};

TEST(IkSearchTest, EveryKeyPoseOfAPlanHasOne) {
  Problem problem = ReachProblem();
  const CandidateReport report = Optimize(problem, kHookPlan);
  ASSERT_TRUE(report.feasible()) << report.reason;
  const robot::Model& model = *problem.robot.model;
  robot::State state(problem.robot.model);
  const CheckResult check = CheckPlan(problem, report.plan);
  EXPECT_TRUE(check.Feasible(problem.program)) << check.Worst();
  VectorXd before;
  for (size_t t = 0; t < report.plan.steps.size(); ++t) {
    const VectorXd& q = report.plan.steps[t].q;
    ASSERT_EQ(q.size(), 7) << t;
    for (int i = 0; i < 7; ++i) {
      EXPECT_GE(q[i], model.lower()[i] + 0.99 * kLimitMargin);
      EXPECT_LE(q[i], model.upper()[i] - 0.99 * kLimitMargin);
    }
    state.Set(q, VectorXd::Zero(7));
    EXPECT_LT((state.X_BH().p - check.X_WHand[t].p).norm(), 1e-5);
    // One branch of the arm from the first key pose to the last: no joint swings round.
    if (t > 0) {
      EXPECT_LT((q - before).cwiseAbs().maxCoeff(), 2.0) << t;
    }
    before = q;
  }
}

TEST(IkSearchTest, TheCheckerRejectsJointsThatAreNoIkSolution) {
  Problem problem = ReachProblem();
  const CandidateReport report = Optimize(problem, {"pick(hook)"});
  ASSERT_TRUE(report.feasible()) << report.reason;
  Plan plan = report.plan;
  plan.steps[0].q[1] += 0.02;
  EXPECT_THAT(CheckPlan(problem, plan).Worst(), HasSubstr("hand of panda at its joints"));
  EXPECT_FALSE(CheckPlan(problem, plan).Feasible(problem.program));
  plan.steps[0].q = VectorXd::Zero(6);
  EXPECT_FALSE(CheckPlan(problem, plan).Feasible(problem.program));
  plan.steps[0].q = report.plan.steps[0].q;
  plan.steps[0].q[6] += 2 * M_PI;
  const CheckResult turned = CheckPlan(problem, plan);
  EXPECT_THAT(turned.Worst(), HasSubstr("limit of joint7"));
  EXPECT_FALSE(turned.Feasible(problem.program));
}

TEST(IkSearchTest, TheCheckerSeesLinksInsideThings) {
  Problem problem = ReachProblem();
  const CandidateReport report = Optimize(problem, {"pick(hook)"});
  ASSERT_TRUE(report.feasible()) << report.reason;
  Problem blocked = problem;
  robot::Kinematics kinematics(problem.robot.model);
  kinematics.Set(report.plan.steps[0].q);
  blocked.scene.objects.push_back(Box("beam", {0.05, 0.05, 0.05}, kinematics.X_BL(4).p, false));
  const CheckResult check = CheckPlan(blocked, report.plan);
  EXPECT_FALSE(check.Feasible(problem.program));
  EXPECT_THAT(check.Worst(), HasSubstr("clearance(panda's link"));
  EXPECT_THAT(check.Worst(), HasSubstr("beam"));
}

TEST(IkSearchTest, WhatIsTooFarIsProvedToBe) {
  const Problem near = BenchProblem({Box("block", {0.05, 0.05, 0.05}, {0.6, 0.1, 0.025}, true)});
  EXPECT_TRUE(Optimize(near, {"pick(block)"}).feasible());
  const Problem far = BenchProblem({Box("block", {0.05, 0.05, 0.05}, {0.95, 0.1, 0.025}, true)});
  const CandidateReport report = Optimize(far, {"pick(block)"});
  EXPECT_EQ(report.status, CandidateStatus::kInfeasible);
  EXPECT_THAT(report.reason, testing::MatchesRegex("pick\\(block\\): [0-9.]+ cm beyond reach"));
  // It is about how far the wrist, above the block, is from the shoulder.
  const double wrist = Vector3d(0.95, 0.1, 0.025 + 0.2104 - 0.333).norm();
  const double said = std::stod(report.reason.substr(report.reason.find(' ')));
  EXPECT_NEAR(said / 100, wrist - far.robot.model->outer_reach().radius, 0.035);
}

// The hand is turned down, and the shelf carries the block by the face it stood on: where the wrist is at
// least is known without a pose.
TEST(IkSearchTest, AShelfTooHighIsProvedToBe) {
  const Problem problem = BenchProblem({Box("block", {0.05, 0.05, 0.05}, {0.5, 0.1, 0.025}, true),
                                        Box("shelf", {0.3, 0.3, 0.02}, {0.5, -0.3, 1.1}, false)});
  const CandidateReport report = Optimize(problem, {"pick(block)", "place(block,shelf)"});
  EXPECT_EQ(report.status, CandidateStatus::kInfeasible);
  EXPECT_THAT(report.reason, testing::MatchesRegex("place\\(block,shelf\\): [0-9.]+ cm beyond reach"));
}

TEST(IkSearchTest, AnApproachThatIsNotFreeMovesTheKeyPoseNotThePlan) {
  // The cheapest key poses bring the box so near to the base that the arm can't lift the hook from there.
  Problem problem = ReachProblem();
  problem.program.home = true;
  const std::vector<std::string> on_shelf{"pick(hook)", "push(hook,box,table)", "place(hook,shelf)",
                                          "pick(box)", "place(box,shelf)"};
  const CandidateReport with_arm = Optimize(problem, on_shelf);
  ASSERT_TRUE(with_arm.feasible()) << with_arm.reason;
  problem.robot.model = nullptr;
  const CandidateReport without = Optimize(problem, on_shelf);
  ASSERT_TRUE(without.feasible()) << without.reason;
  EXPECT_LT(with_arm.plan.cost, 1.1 * without.plan.cost);
}

TEST(IkSearchTest, TheOpenHandIsClearOfWhatElseAnObjectIsMadeOf) {
  // An angle iron: the cheapest place to hold one leg is beside the other.
  Problem problem = BenchProblem({});
  scene::Object angle = Box("angle", {0.12, 0.02, 0.03}, {0.5, 0.1, 0.015}, true);
  angle.shape.parts.push_back(
      {geometry::Box{Vector3d(0.02, 0.12, 0.03)}, math::Pose(Vector3d(0.05, 0.07, 0))});
  problem.scene.objects.push_back(angle);
  for (const double x : {0.35, 0.45, 0.55, 0.62}) {
    problem.scene.objects.back().X_ParentObject.p.x() = x;
    const CandidateReport report = Optimize(problem, {"pick(angle)"});
    ASSERT_TRUE(report.feasible()) << report.reason;
    const math::Pose& X_OH = report.plan.steps[0].X_TC;
    const geometry::Shape hand = problem.robot.model->HandShape(problem.robot.model->gripper().max_opening);
    int beside = 0;
    for (const geometry::Part& part : angle.shape.parts)
      beside += geometry::SignedDistance(hand, X_OH, geometry::Shape({part}), math::Pose()).distance > 0.001;
    EXPECT_GE(beside, 1) << x;
  }
}

TEST(IkSearchTest, WhatTheLinksCantReachUnderIsTold) {
  // A roof low above the block, too wide for the hand to come from above.
  const Problem problem = BenchProblem({Box("block", {0.05, 0.05, 0.05}, {0.5, 0, 0.025}, true),
                                        Box("roof", {0.6, 0.6, 0.02}, {0.5, 0, 0.25}, false)});
  const CandidateReport report = Optimize(problem, {"pick(block)"});
  EXPECT_EQ(report.status, CandidateStatus::kGaveUp);
  EXPECT_THAT(report.reason, HasSubstr("pick(block): "));
  EXPECT_THAT(report.reason, HasSubstr("roof"));
}

TEST(IkSearchTest, UnderARoofTheHandComesFromTheSideIfItMay) {
  // A wrist above the post would be in the roof.
  Problem problem = BenchProblem({Box("post", {0.04, 0.04, 0.16}, {0.5, 0, 0.08}, true),
                                  Box("roof", {0.3, 0.3, 0.02}, {0.62, 0, 0.27}, false)});
  EXPECT_FALSE(Optimize(problem, {"pick(post)"}).feasible());
  const std::string file = robot::DataDirectory() + "/models/actions/manipulation.yaml";
  for (const std::string approach : {"side", "any", "tilted"}) {
    // Half-way between, the hand itself needs more room.
    if (approach == "tilted") problem.scene.objects.back().X_ParentObject.p = Vector3d(0.66, 0, 0.34);
    std::string text = ReadFile(file);
    text.replace(text.find("approach: down"), 14, "approach: " + approach);
    const ScratchFolder folder;
    WriteFile(folder.File("actions.yaml"), text);
    problem.actions = ReadActions(folder.File("actions.yaml"));
    const CandidateReport report = Optimize(problem, {"pick(post)"});
    ASSERT_TRUE(report.feasible()) << approach << ": " << report.reason;
    EXPECT_TRUE(CheckPlan(problem, report.plan).Feasible(problem.program));
    // Not straight down.
    EXPECT_GT(report.plan.steps[0].X_TC.R(2, 2), -0.8);
    EXPECT_EQ(report.plan.steps[0].q.size(), 7);
  }
}

/// Key poses of "pick, place" as planned, but with the hand where the arm has no solution.
struct Strained {
  const std::vector<std::string> actions{"pick(block)", "place(block,bench)"};
  const Problem problem = BenchProblem({Box("block", {0.05, 0.05, 0.05}, {0.5, 0.1, 0.025}, true)});
  const SceneFacts facts{problem};
  const std::vector<BoundStep> steps = BindSkeleton(problem, actions);
  KeyPoseProgram key_poses = BuildProgram(facts, steps, {}, {.near = kNear});
  nlp::Point x = key_poses.guess;

  Strained() {
    const CandidateReport report = Optimize(problem, actions);
    EXPECT_TRUE(report.feasible()) << report.reason;
    for (size_t t = 0; t < x.poses.size(); ++t) x.poses[t] = report.plan.steps[t].X_TC;
    x.poses[1].p = Vector3d(0.36, 0.1, x.poses[1].p.z());  // in the bench's frame: x is 0.86 in the world
  }
};

TEST(IkRowsTest, JointsBecomeVariablesWhereKeyPosesHaveNoIkSolution) {
  Strained s;
  const SceneFacts& facts = s.facts;
  const int terms = static_cast<int>(s.key_poses.program.terms().size());
  ASSERT_TRUE(AddMissingIkSolutions(facts, s.steps, s.x, s.key_poses));
  EXPECT_TRUE(s.key_poses.ik_solutions[0].found);
  EXPECT_FALSE(s.key_poses.ik_solutions[1].found);
  EXPECT_THAT(s.key_poses.ik_solutions[1].problem, HasSubstr("reach"));
  ASSERT_EQ(s.key_poses.program.num_vectors(), 1);
  ASSERT_EQ(s.key_poses.guess.vectors.size(), 1u);
  const auto& all = s.key_poses.program.terms();
  EXPECT_GE(static_cast<int>(all.size()), terms + 3);
  for (size_t i = static_cast<size_t>(terms); i < all.size(); ++i) {
    EXPECT_LT(nlp::JacobianError(*all[i].residual, s.key_poses.program, s.key_poses.guess, 1e-6), 1e-6)
        << all[i].residual->name();
  }
  // The same again adds nothing.
  EXPECT_FALSE(AddMissingIkSolutions(facts, s.steps, s.key_poses.guess, s.key_poses));
}

TEST(IkRowsTest, SolvedTogetherKeyPosesHaveIkSolutions) {
  Strained s;
  const SceneFacts& facts = s.facts;
  ASSERT_TRUE(AddMissingIkSolutions(facts, s.steps, s.x, s.key_poses));
  const nlp::Result result =
      SolveKeyPoses(facts, s.steps, Limits(s.problem.search), 100, nullptr, s.key_poses);
  EXPECT_TRUE(KeepsRows(result)) << result.Summary();
  EXPECT_TRUE(AllHaveIkSolutions(facts, s.key_poses)) << s.key_poses.ik_solutions[1].problem;
  const CheckResult check = CheckKeyPoses(facts, s.steps, result.x.poses, JointsOf(s.key_poses.ik_solutions));
  EXPECT_TRUE(check.Feasible(s.problem.program)) << check.Worst();
  // The program's joint variables are an IK solution themselves.
  robot::Kinematics kinematics(s.problem.robot.model);
  kinematics.Set(result.x.vectors[0]);
  EXPECT_LT((kinematics.X_BH().p - check.X_WHand[1].p).norm(), 1e-4);
}

}  // namespace
}  // namespace tether::planning
