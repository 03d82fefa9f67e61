#include "tether/motion/trajectory.h"

#include <gtest/gtest.h>

#include "tether/common/random.h"

namespace tether::motion {
namespace {

using Eigen::VectorXd;

const std::shared_ptr<const robot::Model>& Panda() {
  static const auto model = robot::Model::Load("panda");
  return model;
}

std::vector<VectorXd> RandomPath(Random& random, int corners) {
  std::vector<VectorXd> path;
  for (int i = 0; i < corners; ++i) {
    VectorXd q(Panda()->dof());
    for (Eigen::Index j = 0; j < q.size(); ++j)
      q[j] = random.Uniform(Panda()->lower()[j], Panda()->upper()[j]);
    path.push_back(q);
  }
  return path;
}

double DistanceFrom(const std::vector<VectorXd>& path, const VectorXd& q) {
  double least = 1e9;
  for (size_t i = 0; i + 1 < path.size(); ++i) {
    const VectorXd along = path[i + 1] - path[i];
    const double s = std::clamp((q - path[i]).dot(along) / along.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (path[i] + s * along - q).cwiseAbs().maxCoeff());
  }
  return least;
}

TEST(TrajectoryTest, KeepsEveryLimitAndEndsAtRestWhereThePathEnds) {
  const JointLimits limits = LimitsOf(*Panda());
  Random random(3);
  JointReference at, before;
  for (int trial = 0; trial < 30; ++trial) {
    const std::vector<VectorXd> path = RandomPath(random, 2 + trial % 4);
    const Trajectory trajectory = TimePath(path, limits);
    EXPECT_LE(trajectory.StretchFor(limits), 1 + 1e-9);
    trajectory.Evaluate(0, &before);
    EXPECT_LT((before.q - path.front()).norm(), 1e-12);
    EXPECT_EQ(before.v.norm(), 0);
    const double dt = 1e-3;
    for (double t = dt; t < trajectory.duration() + dt; t += dt) {
      trajectory.Evaluate(t, &at);
      for (Eigen::Index j = 0; j < at.q.size(); ++j) {
        // Between samples the pieces are cubic: accelerations of the pieces may exceed those of the samples.
        EXPECT_LE(std::abs(at.v[j]), 1.02 * limits.velocity[j]);
        EXPECT_LE(std::abs(at.a[j]), 1.001 * limits.acceleration[j]);
        EXPECT_NEAR(at.q[j] - before.q[j], 0.5 * dt * (at.v[j] + before.v[j]), 2e-5);
      }
      before = at;
    }
    EXPECT_LT((at.q - path.back()).norm(), 1e-9);
    EXPECT_EQ(at.v.norm(), 0);
  }
}

TEST(TrajectoryTest, CutsCornersALittleAndNotAtAllWhereItStops) {
  const JointLimits limits = LimitsOf(*Panda());
  Random random(5);
  JointReference at;
  for (int trial = 0; trial < 10; ++trial) {
    const std::vector<VectorXd> path = RandomPath(random, 4);
    for (const auto& [corners, most] :
         {std::pair(Corners::kRounded, 0.05), std::pair(Corners::kStop, 1e-9)}) {
      const Trajectory trajectory = TimePath(path, limits, corners);
      for (Eigen::Index k = 0; k < trajectory.samples().cols(); ++k)
        EXPECT_LE(DistanceFrom(path, trajectory.samples().col(k)), most);
    }
  }
}

TEST(TrajectoryTest, AlongOneJointItIsAboutAsFastAsCanBe) {
  const JointLimits limits = LimitsOf(*Panda());
  VectorXd from = Panda()->home(), to = from;
  to[0] += 1.5;
  const double fastest = 1.5 / limits.velocity[0] + limits.velocity[0] / limits.acceleration[0];
  const Trajectory trajectory = TimePath({from, to}, limits);
  EXPECT_GT(trajectory.duration(), fastest);
  EXPECT_LT(trajectory.duration(), fastest + 0.25);
}

TEST(TrajectoryTest, AHeavyLoadTakesLonger) {
  const JointLimits limits = LimitsOf(*Panda(), 0.9, 1, 1);
  robot::State state(Panda());
  VectorXd from = Panda()->home(), to = from;
  to[0] += 2;
  to[1] += 0.8;
  const Trajectory free = TimePath({from, to}, limits);
  Trajectory light = free, heavy = free, gentle = free;
  StretchForLoad({.hand_acceleration = 100, .hand_speed = 10}, state, &light);
  StretchForLoad({.payload = 12, .hand_acceleration = 100, .hand_speed = 10}, state, &heavy);
  StretchForLoad({.hand_acceleration = 1, .hand_speed = 10}, state, &gentle);
  EXPECT_GE(light.duration(), free.duration());
  EXPECT_GT(heavy.duration(), 1.1 * light.duration());
  EXPECT_GT(gentle.duration(), 1.5 * free.duration());
}

TEST(TrajectoryTest, APathOfOnePlaceIsARest) {
  const Trajectory trajectory = TimePath({Panda()->home()}, LimitsOf(*Panda()));
  JointReference at;
  trajectory.Evaluate(1, &at);
  EXPECT_EQ(at.q, Panda()->home());
}

}  // namespace
}  // namespace tether::motion
