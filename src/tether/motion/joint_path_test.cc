#include "tether/motion/joint_path.h"

#include <cmath>

#include <gtest/gtest.h>

namespace tether::motion {
namespace {

using Eigen::VectorXd;

/// A wall across a square, x = 0, with a door at 0.7 < y < 0.9.
JointPathProblem Room() {
  JointPathProblem problem;
  problem.lower = Eigen::Vector2d(-1, -1);
  problem.upper = Eigen::Vector2d(1, 1);
  problem.start = Eigen::Vector2d(-0.8, -0.5);
  problem.goals = {Eigen::Vector2d(0.8, -0.5)};
  problem.resolution = 0.02;
  problem.is_free = [](const VectorXd& q) {
    return q.cwiseAbs().maxCoeff() <= 1 && (std::abs(q[0]) > 0.1 || (q[1] > 0.7 && q[1] < 0.9));
  };
  return problem;
}

TEST(JointPathTest, LeadsThroughTheDoor) {
  const JointPathProblem problem = Room();
  const JointPath path = FindJointPath(problem);
  ASSERT_EQ(path.status, JointPathStatus::kFound);
  EXPECT_EQ(path.q.front(), problem.start);
  EXPECT_LT((path.q.back() - problem.goals[0]).norm(), 1e-9);
  for (size_t i = 0; i + 1 < path.q.size(); ++i) {
    for (int k = 0; k <= 200; ++k) {
      const VectorXd q = path.q[i] + (path.q[i + 1] - path.q[i]) * (k / 200.0);
      // Between checks it may cut a corner by less than the resolution.
      EXPECT_TRUE(std::abs(q[0]) > 0.08 || (q[1] > 0.68 && q[1] < 0.92)) << q.transpose();
    }
  }
}

TEST(JointPathTest, TheSameProblemGivesTheSamePath) {
  const JointPath first = FindJointPath(Room()), second = FindJointPath(Room());
  ASSERT_EQ(first.q.size(), second.q.size());
  for (size_t i = 0; i < first.q.size(); ++i) EXPECT_EQ(first.q[i], second.q[i]);
  EXPECT_EQ(first.checks, second.checks);
}

TEST(JointPathTest, SaysWhyThereIsNone) {
  JointPathProblem problem = Room();
  problem.goals = {Eigen::Vector2d(0, 0)};
  EXPECT_EQ(FindJointPath(problem).status, JointPathStatus::kNoFreeGoal);
  problem = Room();
  problem.start = Eigen::Vector2d(0, 0);
  EXPECT_EQ(FindJointPath(problem).status, JointPathStatus::kStartNotFree);
  problem = Room();
  problem.is_free = [](const VectorXd& q) { return std::abs(q[0]) > 0.1; };
  problem.max_checks = 5000;
  const JointPath none = FindJointPath(problem);
  EXPECT_EQ(none.status, JointPathStatus::kGaveUp);
  EXPECT_LT(none.checks, 5100);
  EXPECT_TRUE(none.q.empty());
}

// Of several goals one that can be reached will do.
TEST(JointPathTest, AnyFreeGoalWillDo) {
  JointPathProblem problem = Room();
  problem.goals = {Eigen::Vector2d(0, 0), Eigen::Vector2d(-0.8, 0.5)};
  const JointPath path = FindJointPath(problem);
  ASSERT_EQ(path.status, JointPathStatus::kFound);
  EXPECT_LT((path.q.back() - problem.goals[1]).norm(), 1e-9);
}

}  // namespace
}  // namespace tether::motion
