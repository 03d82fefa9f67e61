#include "tether/motion/transit_search.h"

#include <gtest/gtest.h>

#include "tether/motion/path_checker.h"
#include "tether/motion/start_check.h"
#include "tether/robot/kinematics.h"

namespace tether::motion {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using math::Pose;

const std::shared_ptr<const robot::Model>& Panda() {
  static const auto model = robot::Model::Load("panda");
  return model;
}

/// The hand pointing down at a place.
Pose Down(double x, double y, double z) { return {math::ExpSO3(Vector3d(M_PI, 0, 0)), Vector3d(x, y, z)}; }

Obstacle Box(const std::string& name, const Vector3d& size, const Vector3d& p) {
  return {name, geometry::Shape(geometry::Primitive(geometry::Box{size})), Pose(p)};
}

TransitProblem Problem(std::vector<Obstacle> obstacles, const Pose& goal) {
  TransitProblem problem;
  problem.snapshot.model = Panda();
  problem.snapshot.obstacles = std::move(obstacles);
  problem.snapshot.clearance = 0.01;
  problem.start = Panda()->home();
  problem.goals = {{goal, {}, {}}};
  return problem;
}

Pose HandAt(const VectorXd& q) { return robot::LinkPoses(Panda()->chain(), q).X_BH(); }

void ExpectFree(const TransitProblem& problem, const Transit& transit) {
  Snapshot snapshot = problem.snapshot;
  snapshot.clearance = transit.clearance;
  PathChecker checker(CollisionScene::Compile(snapshot));
  for (size_t i = 0; i + 1 < transit.path.size(); ++i)
    EXPECT_TRUE(checker.IsFree(transit.path[i], transit.path[i + 1])) << i;
}

// swing_across_base: the arm turns round its base, in place of leading the hand over it.
TEST(TransitSearchTest, TheArmTurnsRoundItsBase) {
  for (const double bearing : {-2.0, -1.6, 1.2, 2.2}) {
    TransitProblem problem = Problem({}, Down(0.5 * std::cos(bearing), 0.5 * std::sin(bearing), 0.3));
    problem.start[0] = -bearing;
    const Transit transit = FindTransit(problem);
    ASSERT_TRUE(transit.found()) << transit.reason;
    EXPECT_EQ(transit.path.front(), problem.start);
    EXPECT_LT((HandAt(transit.path.back()).p - problem.goals[0].X_BH.p).norm(), 1e-5);
    ExpectFree(problem, transit);
  }
}

TEST(TransitSearchTest, AWallIsPassedAndTheSameProblemGivesTheSamePath) {
  const TransitProblem problem =
      Problem({Box("wall", {0.3, 0.02, 0.5}, {0.5, 0.15, 0.25})}, Down(0.45, 0.35, 0.2));
  const Transit transit = FindTransit(problem), again = FindTransit(problem);
  ASSERT_TRUE(transit.found()) << transit.reason;
  ExpectFree(problem, transit);
  EXPECT_EQ(transit.path, again.path);
}

// A cup: its axis stays upright along the path, which a straight line of the joints does not keep.
TEST(TransitSearchTest, WhatIsHeldStaysUpright) {
  const Vector3d up(0, 0, 1);
  for (const bool wall : {false, true}) {
    TransitProblem problem = Problem({}, Down(-0.35, 0.35, 0.5));
    problem.goals[0].X_BH.R = math::ExpSO3(Vector3d(0, 0, 1.2)) * problem.goals[0].X_BH.R;
    if (wall) problem.snapshot.obstacles = {Box("wall", {0.02, 0.5, 0.9}, {0.0, 0.45, 0.45})};
    const Pose start = HandAt(problem.start);
    const TiltLimit tilt{start.R.transpose() * up, up, 0.1};
    const auto most = [&](const Transit& transit) {
      TiltManifold manifold(Panda(), tilt);
      double angle = 0;
      for (size_t i = 0; i + 1 < transit.path.size(); ++i) {
        for (int k = 0; k <= 50; ++k)
          angle = std::max(
              angle, manifold.Angle(transit.path[i] + (transit.path[i + 1] - transit.path[i]) * (k / 50.0)));
      }
      return angle;
    };
    const Transit free = FindTransit(problem);
    ASSERT_TRUE(free.found()) << free.reason;
    problem.tilt = tilt;
    const Transit upright = FindTransit(problem);
    ASSERT_TRUE(upright.found()) << upright.reason;
    EXPECT_GT(most(free), 0.1);
    EXPECT_LT(most(upright), 0.101);
    ExpectFree(problem, upright);
  }
}

TEST(TransitSearchTest, AKnownPathIsUsedWhileItIsFree) {
  TransitProblem problem = Problem({}, Down(0.45, 0.35, 0.2));
  const Transit direct = FindTransit(problem);
  ASSERT_TRUE(direct.found());
  problem.goals[0].near = direct.path.back();
  VectorXd middle = 0.5 * (direct.path.front() + direct.path.back());
  middle[3] -= 0.2;
  problem.known = {direct.path.front(), middle, direct.path.back()};
  EXPECT_EQ(FindTransit(problem).path[1], middle);
  problem.snapshot.obstacles = {Box("ball", {0.1, 0.1, 0.1}, HandAt(middle).p)};
  const Transit other = FindTransit(problem);
  ASSERT_TRUE(other.found()) << other.reason;
  ExpectFree(problem, other);
}

TEST(TransitSearchTest, WhatStandsWhereTheHandGoesIsNamed) {
  const Transit transit =
      FindTransit(Problem({Box("crate", {0.2, 0.2, 0.2}, {0.5, 0.2, 0.3})}, Down(0.5, 0.2, 0.3)));
  EXPECT_EQ(transit.status, PathStatus::kNoFreeGoal);
  EXPECT_EQ(transit.blocker, "crate");
  EXPECT_NE(transit.reason.find("inside crate"), std::string::npos) << transit.reason;
}

TEST(TransitSearchTest, AStartThatTouchesIsLeftAndOneThatIsDeepInsideIsSaid) {
  const Pose hand = HandAt(Panda()->home());
  for (const double depth : {0.003, 0.05}) {
    const TransitProblem problem =
        Problem({Box("wall", {0.02, 0.4, 0.4}, hand.p + Vector3d(0.03 + 0.01 - depth, 0, 0.1))},
                Down(0.35, 0.3, 0.3));
    const Transit transit = FindTransit(problem);
    if (depth < 0.02) {
      EXPECT_TRUE(transit.found()) << transit.reason;
    } else {
      EXPECT_EQ(transit.status, PathStatus::kStartNotFree);
      EXPECT_NE(transit.reason.find("where the arm stands, "), std::string::npos) << transit.reason;
      EXPECT_EQ(transit.blocker, "wall");
    }
  }
}

// arm_starts_in_wall, and a base that stands in a table.
TEST(StartCheckTest, OverlapsOfArmAndBaseAreFound) {
  Snapshot snapshot;
  snapshot.model = Panda();
  EXPECT_TRUE(FindOverlaps(snapshot, Panda()->home()).empty());
  snapshot.obstacles = {Box("wall", {0.1, 0.4, 0.3}, {0.1, 0, 0.6})};
  std::vector<Touch> touches = FindOverlaps(snapshot, Panda()->home());
  ASSERT_EQ(touches.size(), 1u);
  EXPECT_EQ(touches[0].b, "wall");
  EXPECT_LT(touches[0].distance, -0.01);
  snapshot.obstacles = {Box("table", {0.6, 1.1, 0.3}, {0.1, 0, -0.1})};
  touches = FindOverlaps(snapshot, Panda()->home());
  ASSERT_EQ(touches.size(), 1u);
  EXPECT_EQ(touches[0].b, "table");
  AddArm("other", *Panda(), Panda()->home(), Pose(Vector3d(0.02, 0, 0)), &snapshot.obstacles);
  EXPECT_GE(FindOverlaps(snapshot, Panda()->home()).size(), 2u);
}

}  // namespace
}  // namespace tether::motion
