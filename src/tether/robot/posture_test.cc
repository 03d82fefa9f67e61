#include "tether/robot/posture.h"

#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/geometry/distance/distance.h"
#include "tether/robot/model.h"

namespace tether::robot {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using math::Pose;

std::shared_ptr<const Model> Panda() {
  static const std::shared_ptr<const Model> model = Model::Load("panda");
  return model;
}

PostureProblem ProblemAt(const Pose& X_BH) {
  PostureProblem problem;
  problem.X_BH = X_BH;
  problem.rest = Panda()->home();
  NarrowLimits(*Panda(), 0.03, problem.lower, problem.upper);
  return problem;
}

Posture From(const VectorXd& q) {
  Posture posture;
  posture.q = q;
  return posture;
}

/// Hand poses of configurations without self-collision.
std::vector<VectorXd> ClearConfigurations(int count, Random& random) {
  std::vector<VectorXd> all;
  PostureSolver solver(Panda());
  Kinematics kinematics(Panda());
  while (static_cast<int>(all.size()) < count) {
    PostureProblem problem = ProblemAt({});
    Posture posture = From(problem.lower);
    for (int i = 0; i < 7; ++i) posture.q[i] = random.Uniform(problem.lower[i], problem.upper[i]);
    solver.Assess(problem, posture);
    if (posture.distance >= problem.clearance) all.push_back(posture.q);
  }
  return all;
}

TEST(PostureTest, WhatItCallsFoundIsFound) {
  Random random(1);
  PostureSolver solver(Panda());
  State state(Panda());
  int found = 0;
  for (const VectorXd& q : ClearConfigurations(200, random)) {
    state.Set(q, VectorXd::Zero(7));
    const PostureProblem problem = ProblemAt(state.X_BH());
    Posture posture = From(Panda()->home());
    if (!solver.Solve(problem, posture)) continue;
    ++found;
    EXPECT_TRUE((posture.q.array() >= problem.lower.array()).all() &&
                (posture.q.array() <= problem.upper.array()).all());
    state.Set(posture.q, VectorXd::Zero(7));
    EXPECT_LT((state.X_BH().p - problem.X_BH.p).norm(), 1e-6);
    EXPECT_LT(math::AngleBetween(state.X_BH().R, problem.X_BH.R), 1e-6);
    EXPECT_GE(posture.distance, problem.clearance);
  }
  // Any reachable pose, solved from home alone; many need contorted configurations.
  EXPECT_GT(found, 110);
}

// Next to a singularity, or to a limit, the joints may have to turn further.
TEST(PostureTest, NearbyPosesNearlyAlwaysKeepTheBranch) {
  int found = 0, kept = 0;
  Random random(2);
  PostureSolver solver(Panda());
  Kinematics kinematics(Panda());
  for (const VectorXd& q : ClearConfigurations(50, random)) {
    kinematics.Set(q);
    PostureProblem problem = ProblemAt(kinematics.X_BH() * Pose(Vector3d(0.01, -0.01, 0.01)));
    problem.rest = q;
    Posture posture = From(q);
    if (!solver.Solve(problem, posture)) continue;
    ++found;
    kept += (posture.q - q).cwiseAbs().maxCoeff() < 0.6 ? 1 : 0;
  }
  EXPECT_GT(found, 25);
  EXPECT_GE(kept, 0.9 * found);
}

// A rod where the elbow would be: the arm, which has a joint to spare, turns it away and keeps the hand.
TEST(PostureTest, TheElbowEvadesARod) {
  PostureSolver solver(Panda());
  Kinematics kinematics(Panda());
  kinematics.Set(Panda()->home());
  PostureProblem problem = ProblemAt(kinematics.X_BH());
  Posture free = From(Panda()->home());
  ASSERT_TRUE(solver.Solve(problem, free));
  kinematics.Set(free.q);
  const geometry::Part rod{geometry::Capsule{0.02, 0.3}, Pose(kinematics.X_BL(4).p + Vector3d(0, 0.08, 0.0))};
  problem.obstacles.emplace_back(rod, Pose(), true);
  Posture blocked = free;
  solver.Assess(problem, blocked);
  ASSERT_LT(blocked.distance, 0.0);
  EXPECT_EQ(blocked.obstacle, 0);
  ASSERT_TRUE(solver.Solve(problem, blocked));
  EXPECT_GE(blocked.distance, problem.clearance);
  EXPECT_LT(blocked.position_error, 1e-6);
  // The reported distance is that of the shapes.
  kinematics.Set(blocked.q);
  for (int k = 1; k < Panda()->solids().hand(); ++k) {
    EXPECT_GE(geometry::SignedDistance(Panda()->solids().links[k].shape, kinematics.X_BSolid(k),
                                       geometry::Shape({rod}), Pose())
                  .distance,
              problem.clearance - 1e-9);
  }
}

TEST(PostureTest, OutOfReachTellsHowFar) {
  PostureSolver solver(Panda());
  const Eigen::Matrix3d down = math::RotationFromRpy({M_PI, 0, 0});
  PostureProblem problem = ProblemAt({down, {1.2, 0, 0.333 - 0.2104}});
  Posture posture = From(Panda()->home());
  EXPECT_FALSE(solver.Solve(problem, posture));
  EXPECT_FALSE(posture.reaches());
  EXPECT_GT(posture.position_error + posture.rotation_error, 0.25);
}

}  // namespace
}  // namespace tether::robot
