#include "tether/motion/path_search.h"

#include <atomic>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/motion/random_scene.h"
#include "testing/motion/slow_checker.h"
#include "tether/common/limits.h"

namespace tether::motion {
namespace {

using Eigen::VectorXd;
using testing::StartsWith;

std::shared_ptr<const robot::Model> Panda() {
  static const std::shared_ptr<const robot::Model> model = robot::Model::Load("panda_flange");
  return model;
}

/// A post beside the arm, which has to get to its other side, below a roof.
Snapshot Posts() {
  Snapshot snapshot;
  snapshot.model = Panda();
  snapshot.obstacles.push_back({"post", geometry::Shape(geometry::Box{{0.06, 0.06, 0.9}}),
                                math::Pose(Eigen::Vector3d(0.45, 0, 0.45))});
  snapshot.obstacles.push_back(
      {"roof", geometry::Shape(geometry::Box{{1.5, 1.5, 0.05}}), math::Pose(Eigen::Vector3d(0.6, 0, 1.0))});
  return snapshot;
}

PathProblem AroundThePost(const Snapshot& snapshot) {
  PathProblem problem;
  problem.scene = CollisionScene::Compile(snapshot);
  problem.lower = Panda()->lower();
  problem.upper = Panda()->upper();
  problem.start = Panda()->home();
  problem.start[0] = -0.7;
  VectorXd goal = problem.start;
  goal[0] = 0.7;
  problem.goals = {goal};
  return problem;
}

TEST(PathSearchTest, LeadsAroundThePostAndIsFree) {
  const Snapshot snapshot = Posts();
  const PathProblem problem = AroundThePost(snapshot);
  for (const int smoothing : {0, 3}) {
    PathProblem smooth = problem;
    smooth.smoothing = smoothing;
    const Path path = FindPath(smooth);
    ASSERT_EQ(path.status, PathStatus::kFound) << path.reason;
    EXPECT_GT(path.q.size(), 2u);
    EXPECT_EQ(path.q.front(), problem.start);
    EXPECT_EQ(path.q.back(), problem.goals[0]);
    for (size_t i = 0; i + 1 < path.q.size(); ++i) {
      for (int k = 0; k <= 100; ++k)
        ASSERT_GT(SlowDistance(snapshot, path.q[i] + (path.q[i + 1] - path.q[i]) * (k / 100.0)), 0);
    }
  }
}

// The same seed gives the same path, with and without SIMD, in any scene.
TEST(PathSearchTest, SimdAndPlainGiveTheSamePaths) {
  int found = 0;
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    PathProblem problem;
    problem.scene = CollisionScene::Compile(RandomScene(Panda(), seed, 6));
    problem.lower = Panda()->lower();
    problem.upper = Panda()->upper();
    problem.seed = seed;
    problem.max_checks = 20000;
    Random random(seed);
    PathChecker checker(problem.scene);
    const auto sample = [&] {
      for (;;) {
        VectorXd q = RandomConfiguration(*Panda(), random);
        if (checker.IsFree(q)) return q;
      }
    };
    problem.start = sample();
    problem.goals = {sample(), sample()};
    const Path simd = FindPath(problem), again = FindPath(problem);
    problem.lanes = Lanes::kPlain;
    const Path plain = FindPath(problem);
    EXPECT_EQ(simd.q, again.q);
    EXPECT_EQ(simd.q, plain.q);
    EXPECT_EQ(simd.checks, plain.checks);
    EXPECT_EQ(simd.nodes, plain.nodes);
    found += simd.status == PathStatus::kFound;
  }
  EXPECT_GT(found, 6);
}

TEST(PathSearchTest, AnyFreeGoalWillDo) {
  PathProblem problem = AroundThePost(Posts());
  VectorXd in_post = problem.start;
  in_post[0] = 0;
  problem.goals.insert(problem.goals.begin(), in_post);
  const Path path = FindPath(problem);
  ASSERT_EQ(path.status, PathStatus::kFound);
  EXPECT_EQ(path.goal, 1);
  EXPECT_EQ(path.q.back(), problem.goals[1]);
}

TEST(PathSearchTest, SaysWhatIsInTheWay) {
  PathProblem problem = AroundThePost(Posts());
  const VectorXd start = problem.start;
  problem.start[0] = 0;
  Path path = FindPath(problem);
  EXPECT_EQ(path.status, PathStatus::kStartNotFree);
  EXPECT_THAT(path.reason, StartsWith("at the start, link7 is "));
  EXPECT_THAT(path.reason, testing::EndsWith(" mm inside post"));
  problem.goals = {problem.start};
  problem.start = start;
  path = FindPath(problem);
  EXPECT_EQ(path.status, PathStatus::kNoFreeGoal);
  EXPECT_THAT(path.reason, StartsWith("at the goal, link7 is "));
  EXPECT_TRUE(path.q.empty());
}

/// A wall across a square, x = 0, with a door at 0.7 < y < 0.9.
PathProblem Room() {
  PathProblem problem;
  problem.lower = Eigen::Vector2d(-1, -1);
  problem.upper = Eigen::Vector2d(1, 1);
  problem.start = Eigen::Vector2d(-0.8, -0.5);
  problem.goals = {Eigen::Vector2d(0.8, -0.5)};
  problem.resolution = 0.02;
  problem.range = 0.5;
  problem.max_checks = 20'000;
  problem.is_free = [](const VectorXd& q) {
    return q.cwiseAbs().maxCoeff() <= 1 && (std::abs(q[0]) > 0.1 || (q[1] > 0.7 && q[1] < 0.9));
  };
  return problem;
}

TEST(PathSearchTest, APredicateLeadsThroughTheDoor) {
  const PathProblem problem = Room();
  const Path path = FindPath(problem), again = FindPath(problem);
  ASSERT_EQ(path.status, PathStatus::kFound);
  EXPECT_EQ(path.q.front(), problem.start);
  EXPECT_EQ(path.q.back(), problem.goals[0]);
  EXPECT_EQ(path.q, again.q);
  EXPECT_EQ(path.checks, again.checks);
  for (size_t i = 0; i + 1 < path.q.size(); ++i) {
    for (int k = 0; k <= 200; ++k) {
      const VectorXd q = path.q[i] + (path.q[i + 1] - path.q[i]) * (k / 200.0);
      // Between checks it may cut a corner by less than the resolution.
      EXPECT_TRUE(std::abs(q[0]) > 0.08 || (q[1] > 0.68 && q[1] < 0.92)) << q.transpose();
    }
  }
}

TEST(PathSearchTest, APredicateSaysWhyThereIsNone) {
  PathProblem problem = Room();
  problem.goals = {Eigen::Vector2d(0, 0)};
  EXPECT_EQ(FindPath(problem).reason, "at the goal, something is too near");
  problem.goals.push_back(Eigen::Vector2d(-0.8, 0.5));
  EXPECT_EQ(FindPath(problem).goal, 1);
  problem = Room();
  problem.start = Eigen::Vector2d(0, 0);
  EXPECT_EQ(FindPath(problem).status, PathStatus::kStartNotFree);
  problem = Room();
  problem.is_free = [](const VectorXd& q) { return std::abs(q[0]) > 0.1; };
  problem.max_checks = 5000;
  const Path none = FindPath(problem);
  EXPECT_EQ(none.status, PathStatus::kGaveUp);
  EXPECT_LT(none.checks, 5100);
}

TEST(PathSearchTest, EndsWhenAStopIsRequested) {
  PathProblem problem = Room();
  problem.is_free = [](const VectorXd& q) { return std::abs(q[0]) > 0.1; };
  const std::atomic<bool> stop = true;
  Limits limits;
  limits.interrupted = &stop;
  const LimitsScope scope(limits);
  EXPECT_THROW(FindPath(problem), LimitReached);
}

TEST(PathSearchTest, GivesUpAtTheLimit) {
  PathProblem problem = AroundThePost(Posts());
  problem.lower[0] = -0.75;
  problem.upper[0] = -0.1;  // The goal's side of the post is out of the space that is searched.
  problem.max_checks = 50;
  const Path path = FindPath(problem);
  EXPECT_EQ(path.status, PathStatus::kGaveUp);
  EXPECT_EQ(path.reason, "no path was found with 50 configurations");
}

}  // namespace
}  // namespace tether::motion
