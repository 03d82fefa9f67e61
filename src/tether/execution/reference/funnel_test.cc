#include <numbers>

#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/execution/reference/transit.h"
#include "tether/math/so3.h"

namespace tether::execution {
namespace {

using Eigen::Vector3d;
using math::Pose;

Pose RandomPose(Random& random, double reach) {
  math::Vector6d delta;
  for (int i = 0; i < 6; ++i) delta[i] = random.Uniform(-reach, reach);
  return math::ExpSE3(delta);
}

/// An approach of 12 cm to a goal somewhere, with hand and reference near it.
struct Approach {
  explicit Approach(uint64_t seed) {
    Random random(seed);
    X_TG = RandomPose(random, 1);
    direction = X_TG.R * Vector3d::UnitZ();
    X_TR = X_TG * RandomPose(random, 0.15);
    X_TH = X_TR * RandomPose(random, 0.05);
  }
  Pose Waypoint() const { return FunnelWaypoint(X_TG, direction, length, X_TR, X_TH); }

  Pose X_TG, X_TR, X_TH;
  Vector3d direction;
  double length = 0.12;
};

// A hand on the line, turned as the goal is, may go all the way, however far before the goal it is.
TEST(FunnelLaws, OnTheLineTheGoalIsNext) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    Approach approach(seed);
    for (const double before : {0.0, 0.02, 0.5}) {
      approach.X_TH = Pose(approach.X_TG.R, approach.X_TG.p - before * approach.direction);
      EXPECT_EQ(approach.Waypoint().p, approach.X_TG.p);
      EXPECT_EQ(approach.Waypoint().R, approach.X_TG.R);
    }
  }
}

// What is next is on the approach, turned as the goal is; or the reference steps straight back.
TEST(FunnelLaws, TheWaypointIsOnTheLineOrStraightBack) {
  int on_line = 0, back = 0;
  for (uint64_t seed = 1; seed <= 300; ++seed) {
    const Approach approach(seed);
    const Pose X = approach.Waypoint();
    const Vector3d from_goal = X.p - approach.X_TG.p, from_reference = X.p - approach.X_TR.p;
    const double ahead = approach.direction.dot(from_goal);
    EXPECT_LE(ahead, 1e-12);
    if (X.R == approach.X_TG.R) {
      ++on_line;
      EXPECT_NEAR((from_goal - ahead * approach.direction).norm(), 0, 1e-12);
      EXPECT_GE(ahead, -approach.length - 1e-12);
    } else {
      ++back;
      EXPECT_EQ(X.R, approach.X_TR.R) << "it turns only where it has room";
      const double step = approach.direction.dot(from_reference);
      EXPECT_LT(step, 0);
      EXPECT_NEAR((from_reference - step * approach.direction).norm(), 0, 1e-12);
    }
  }
  EXPECT_GT(on_line, 20);
  EXPECT_GT(back, 20);
}

// The further beside the line, and the more turned, the further back: never into what is reached for.
TEST(FunnelLaws, WhatIsFurtherBesideStaysFurtherBack) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    Approach approach(seed);
    const Vector3d aside = approach.direction.unitOrthogonal();
    double last_offset = 0, last_turn = 0;
    for (int i = 0; i <= 20; ++i) {
      const Vector3d far = approach.X_TG.p - 0.3 * approach.direction;
      approach.X_TR = Pose(approach.X_TG.R, far);
      approach.X_TH = Pose(approach.X_TG.R, far + 0.005 * i * aside);
      const double offset = (approach.Waypoint().p - approach.X_TG.p).norm();
      EXPECT_GE(offset, last_offset - 1e-12);
      EXPECT_LE(offset, approach.length + 1e-12);
      last_offset = offset;
      approach.X_TH = Pose(approach.X_TG.R * math::ExpSO3(0.05 * i * Vector3d::UnitX()), far);
      const double turn = (approach.Waypoint().p - approach.X_TG.p).norm();
      EXPECT_GE(turn, last_turn - 1e-12);
      last_turn = turn;
    }
    EXPECT_NEAR(last_offset, approach.length, 1e-12) << "at 10 cm the approach begins anew";
    EXPECT_GT(last_turn, 0.05);
  }
}

// All is in the target's frame: where that is does not matter.
TEST(FunnelLaws, MovingTheTargetMovesTheWaypointAlong) {
  for (uint64_t seed = 1; seed <= 100; ++seed) {
    Random random(seed + 1000);
    const Pose X = RandomPose(random, 2);
    Approach approach(seed);
    const Pose before = approach.Waypoint();
    approach.X_TG = X * approach.X_TG;
    approach.X_TR = X * approach.X_TR;
    approach.X_TH = X * approach.X_TH;
    approach.direction = X.R * approach.direction;
    const Pose after = approach.Waypoint();
    EXPECT_LT((after.p - (X * before).p).norm(), 1e-9);
    EXPECT_LT((after.R - (X * before).R).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace tether::execution
