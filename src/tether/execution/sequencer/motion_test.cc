#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/execution/observer/contact_detector.h"
#include "tether/execution/observer/frame_tracker.h"
#include "tether/execution/reference/pose_reference.h"
#include "tether/execution/reference/posture_search.h"
#include "tether/execution/reference/transit.h"

namespace tether::execution {
namespace {

using math::Pose;
using math::Vector6d;

constexpr double kTick = 0.001;

Pose RandomPose(Random* random, double size) {
  const auto draw = [&] { return random->Uniform(-1, 1); };
  return {math::ExpSO3(Eigen::Vector3d(draw(), draw(), draw())),
          size * Eigen::Vector3d(draw(), draw(), draw())};
}

TEST(PoseReference, ArrivesWithinItsLimits) {
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    PoseReference reference;
    reference.Reset(RandomPose(&random, 0.5));
    const Pose goal = RandomPose(&random, 0.5);
    const MotionLimits limits;
    const double distance = (goal.p - reference.X_TR().p).norm();
    double overshoot = 0;
    Vector6d before = reference.V_TR();
    for (int i = 0; i < 8000; ++i) {
      const Pose X_before = reference.X_TR();
      reference.Advance(goal, limits, kTick);
      const Vector6d& V = reference.V_TR();
      ASSERT_LE(V.head<3>().norm(), limits.speed * 1.001);
      ASSERT_LE(V.tail<3>().norm(), limits.angular_speed * 1.001);
      ASSERT_LE((V - before).head<3>().norm() / kTick, limits.acceleration * 1.001);
      ASSERT_LE((V - before).tail<3>().norm() / kTick, limits.angular_acceleration * 1.001);
      ASSERT_LT((reference.X_TR().p - X_before.p - kTick * V.head<3>()).norm(), 1e-12);
      before = V;
      overshoot = std::max(overshoot, (reference.X_TR().p - goal.p).norm() - distance);
    }
    EXPECT_LT((reference.X_TR().p - goal.p).norm(), 1e-6);
    EXPECT_LT(math::AngleBetween(reference.X_TR().R, goal.R), 1e-6);
    EXPECT_LT(overshoot, 1e-6) << "from rest it goes straight";
  }
}

TEST(PoseReference, ChangesGoalWhileMoving) {
  PoseReference reference;
  reference.Reset(Pose());
  const MotionLimits limits;
  for (int i = 0; i < 1000; ++i) reference.Advance(Pose(Eigen::Vector3d(1, 0, 0)), limits, kTick);
  EXPECT_GT(reference.V_TR().x(), 0.2);
  const Pose back(Eigen::Vector3d(0, 0.3, 0));
  for (int i = 0; i < 5000; ++i) reference.Advance(back, limits, kTick);
  EXPECT_LT((reference.X_TR().p - back.p).norm(), 1e-5);
}

TEST(FrameTracker, FollowsConstantVelocityWithoutLag) {
  const Vector6d V = (Vector6d() << 0.1, -0.05, 0.02, 0.3, 0.1, -0.2).finished();
  const auto pose_at = [&](double t) {
    return Pose(math::ExpSO3(t * V.tail<3>()) * math::ExpSO3(Eigen::Vector3d(0.3, 1, 2)), t * V.head<3>());
  };
  // Measured at every tick, and at 30 Hz only.
  for (const int every : {1, 33}) {
    FrameTracker tracker;
    tracker.Reset(pose_at(0), 0);
    for (int i = 1; i < 2000; ++i) {
      tracker.Predict(i * kTick);
      if (i % every == 0) tracker.Correct(pose_at(i * kTick));
    }
    const Pose truth = pose_at(1.999);
    EXPECT_LT((tracker.X_WF().p - truth.p).norm(), 1e-5);
    EXPECT_LT(math::AngleBetween(tracker.X_WF().R, truth.R), 1e-4);
    EXPECT_LT((tracker.V_WF() - V).norm(), 1e-3);
  }
}

TEST(FrameTracker, SmoothsJumpsAndComesToRest) {
  FrameTracker tracker;
  tracker.Reset(Pose(), 0);
  const Pose jump(Eigen::Vector3d(0.1, 0, 0));
  double step = 0;
  for (int i = 1; i < 500; ++i) {
    const double before = tracker.X_WF().p.x();
    tracker.Predict(i * kTick);
    tracker.Correct(jump);
    step = std::max(step, tracker.X_WF().p.x() - before);
  }
  EXPECT_LT(step, 0.02);
  EXPECT_NEAR(tracker.X_WF().p.x(), 0.1, 1e-6);
  EXPECT_LT(tracker.V_WF().norm(), 1e-4);
}

// The box about a primitive is tight: it touches the farthest of many surface points in each direction.
TEST(Transit, BoundsAreTight) {
  Random random(3);
  const geometry::Primitive primitives[] = {geometry::Box{{0.1, 0.2, 0.3}}, geometry::Sphere{0.1},
                                            geometry::Capsule{0.05, 0.3}, geometry::Cylinder{0.1, 0.2}};
  for (const auto& primitive : primitives) {
    const Pose X = RandomPose(&random, 1);
    const geometry::Aabb bounds = geometry::BoundingBox(primitive, X);
    Eigen::Vector3d lower = Eigen::Vector3d::Constant(1e9);
    Eigen::Vector3d upper = -lower;
    for (int i = 0; i < 200000; ++i) {
      Eigen::Vector3d d(random.Normal(), random.Normal(), random.Normal());
      d.normalize();
      Eigen::Vector3d p = Eigen::Vector3d::Zero();
      if (const auto* box = std::get_if<geometry::Box>(&primitive)) {
        p = 0.5 * box->size.cwiseProduct(d.cwiseSign());
      } else if (const auto* sphere = std::get_if<geometry::Sphere>(&primitive)) {
        p = sphere->radius * d;
      } else if (const auto* capsule = std::get_if<geometry::Capsule>(&primitive)) {
        p = capsule->radius * d;
        p.z() += (d.z() > 0 ? 0.5 : -0.5) * capsule->length;
      } else {
        const auto& cylinder = std::get<geometry::Cylinder>(primitive);
        p.head<2>() = cylinder.radius * d.head<2>().normalized();
        p.z() = (d.z() > 0 ? 0.5 : -0.5) * cylinder.length;
      }
      lower = lower.cwiseMin(X * p);
      upper = upper.cwiseMax(X * p);
    }
    EXPECT_LT((lower - bounds.lower).norm(), 1e-3);
    EXPECT_LT((upper - bounds.upper).norm(), 1e-3);
    EXPECT_LE((bounds.lower - lower).maxCoeff(), 1e-9);
    EXPECT_LE((upper - bounds.upper).maxCoeff(), 1e-9);
  }
}

class TransitPassage : public testing::Test {
 protected:
  // A hand that reaches 5 cm down, and a tower 30 cm high between two places.
  const std::vector<geometry::Aabb> body_{{{-0.03, -0.1, -0.05}, {0.03, 0.1, 0.1}}};
  const std::vector<geometry::Aabb> tower_{{{0.45, -0.03, 0}, {0.55, 0.03, 0.3}}};
  const TransitMargins margins_;
};

TEST_F(TransitPassage, FindsTheHeightThatClears) {
  const Eigen::Vector3d from(0.5, -0.3, 0.1);
  const Eigen::Vector3d to(0.5, 0.3, 0.1);
  const Passage passage = CheckPassage(body_, from, to, tower_, margins_, 1);
  EXPECT_TRUE(passage.blocked);
  EXPECT_NEAR(passage.height, 0.3 + 0.05 + margins_.above, 1e-12);
  const Eigen::Vector3d up(0, 0, passage.height - 0.1 + 1e-9);
  EXPECT_FALSE(CheckPassage(body_, from + up, to + up, tower_, margins_, 1).blocked);
  // Far enough beside it, above the ceiling, or beneath.
  const Eigen::Vector3d aside(0.11, 0, 0);
  EXPECT_FALSE(CheckPassage(body_, from + aside, to + aside, tower_, margins_, 1).blocked);
  EXPECT_FALSE(CheckPassage(body_, from, to, tower_, margins_, 0.3).blocked);
  const std::vector<geometry::Aabb> bridge{{{0, -0.03, 0.5}, {1, 0.03, 0.6}}};
  EXPECT_FALSE(CheckPassage(body_, from, to, bridge, margins_, 1).blocked);
}

// Following the waypoints with a reference never brings the body near the tower, and ends at the goal.
TEST_F(TransitPassage, WaypointsLeadOverTheTower) {
  const Pose goal(math::ExpSO3({0, 0, 1}), {0.5, 0.3, 0.1});
  PoseReference reference;
  reference.Reset(Pose(Eigen::Vector3d(0.5, -0.3, 0.1)));
  double nearest = 1;
  for (int i = 0; i < 10000; ++i) {
    const Eigen::Vector3d p = reference.X_TR().p;
    const Passage passage = CheckPassage(body_, p, goal.p, tower_, margins_, 1);
    reference.Advance(TransitWaypoint(passage, reference.X_TR(), goal), {}, kTick);
    Eigen::Vector3d gap =
        (tower_[0].lower - body_[0].upper - p).cwiseMax(p + body_[0].lower - tower_[0].upper);
    nearest = std::min(nearest, gap.maxCoeff());
  }
  EXPECT_GT(nearest, 0.01);
  EXPECT_LT((reference.X_TR().p - goal.p).norm(), 1e-5);
  EXPECT_LT(math::AngleBetween(reference.X_TR().R, goal.R), 1e-5);
}

TEST(Transit, WhatLeadsBeyondReachIsDrawnNear) {
  const math::Pose X_WH(math::RotationFromRpy({M_PI, 0, 0.3}), Eigen::Vector3d(0.7, 0.3, 0.5));
  const Eigen::Vector3d p_HQ(0, 0, -0.2), p_WCentre(0, 0, 0.3);
  const math::Pose drawn = DrawWithin(X_WH, p_HQ, p_WCentre, 0.6);
  EXPECT_EQ(drawn.R, X_WH.R);
  EXPECT_NEAR((drawn * p_HQ - p_WCentre).norm(), 0.6, 1e-12);
  // No further than it must be.
  EXPECT_NEAR((drawn.p - X_WH.p).norm(), (X_WH * p_HQ - p_WCentre).norm() - 0.6, 1e-12);
  EXPECT_EQ(DrawWithin(X_WH, p_HQ, p_WCentre, 2).p, X_WH.p);
}

TEST(ContactDetector, FeelsResistanceButNotThePayload) {
  ContactDetector detector;
  detector.Start();
  const Eigen::Vector3d down(0, 0, -1);
  Random random(5);
  Eigen::Vector3d weight(0.1, 0, -3);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d noise(0.2 * random.Normal(), 0.2 * random.Normal(), 0.2 * random.Normal());
    ASSERT_FALSE(detector.Update(weight + noise, down, kTick));
  }
  // A blow of one tick is not contact.
  EXPECT_FALSE(detector.Update(weight + Eigen::Vector3d(0, 0, 20), down, kTick));
  EXPECT_FALSE(detector.Update(weight, down, kTick));
  // A pull along the motion is not either.
  for (int i = 0; i < 50; ++i) ASSERT_FALSE(detector.Update(weight - Eigen::Vector3d(0, 0, 20), down, kTick));
  bool felt = false;
  for (int i = 0; i < 10; ++i) felt = detector.Update(weight + Eigen::Vector3d(0, 0, 4), down, kTick);
  EXPECT_TRUE(felt);
  EXPECT_NEAR(detector.resistance(), 4, 0.1);
}

TEST(ContactDetector, FindsTheWrenchOnTheHand) {
  const auto model = robot::Model::Load("panda");
  const robot::State state(model);
  Vector6d wrench;
  wrench << 1, -2, 8, 0.1, 0.3, -0.2;
  EXPECT_LT((HandWrench(state, state.J_BH().transpose() * wrench) - wrench).norm(), 1e-3);
}

TEST(PostureSearch, TakesTheTurnWithRoomToTheLimits) {
  const auto model = robot::Model::Load("panda");
  robot::State state(model);
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(7);
  PostureSearch search(model);
  for (const double yaw : {-2.0, -1.0, -0.2, 0.3, 1.2, 2.1, 3.0}) {
    const Pose X_BH(math::ExpSO3({0, 0, yaw}) * math::RotationFromRpy({std::numbers::pi, 0, 0}),
                    {0.5, 0.2, 0.15});
    const Pose turned = X_BH * Pose(math::ExpSO3({0, 0, std::numbers::pi}), Eigen::Vector3d::Zero());
    const Pose candidates[] = {X_BH, turned};
    search.Start(model->home(), candidates, 2);
    while (!search.done()) search.Advance();
    EXPECT_TRUE(search.reached()) << yaw;
    state.Set(search.q(), rest);
    EXPECT_LT((state.X_BH().p - candidates[search.best()].p).norm(), 0.005);
    EXPECT_GT(std::min((search.q() - model->lower()).minCoeff(), (model->upper() - search.q()).minCoeff()),
              0.25);
    // Which of the two is called the plan's own makes no difference.
    const int best = search.best();
    const Pose swapped[] = {turned, X_BH};
    search.Start(model->home(), swapped, 2);
    while (!search.done()) search.Advance();
    EXPECT_EQ(search.best(), 1 - best) << yaw;
  }
  const Pose far(Eigen::Vector3d(2, 0, 0));
  search.Start(model->home(), &far, 1);
  while (!search.done()) search.Advance();
  EXPECT_FALSE(search.reached());
}

TEST(PostureSearch, AGivenPostureIsKeptWhereItFits) {
  const auto model = robot::Model::Load("panda");
  robot::State state(model);
  Eigen::VectorXd planned(7);
  planned << 0.4, -0.2, -0.7, -2.2, -0.3, 2.1, 0.6;  // the elbow out to a side, where home would not have it
  state.Set(planned, Eigen::VectorXd::Zero(7));
  const Pose near = state.X_BH() * Pose(Eigen::Vector3d(0.01, -0.02, 0.01));
  const Pose candidates[] = {near,
                             near * Pose(math::ExpSO3({0, 0, std::numbers::pi}), Eigen::Vector3d::Zero())};
  PostureSearch search(model);
  search.Start(model->home(), candidates, 2, &planned);
  while (!search.done()) search.Advance();
  EXPECT_TRUE(search.reached());
  EXPECT_EQ(search.best(), 0);
  EXPECT_LT((search.q() - planned).cwiseAbs().maxCoeff(), 0.15);
  // For a hand elsewhere it means nothing: the search is as without it.
  const Pose elsewhere(math::RotationFromRpy({std::numbers::pi, 0, 0}), {-0.4, 0.4, 0.3});
  PostureSearch with(model), without(model);
  with.Start(model->home(), &elsewhere, 1, &planned);
  while (!with.done()) with.Advance();
  without.Start(model->home(), &elsewhere, 1);
  while (!without.done()) without.Advance();
  EXPECT_EQ(with.q(), without.q());
}

}  // namespace
}  // namespace tether::execution
