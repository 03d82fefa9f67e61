#include "tether/geometry/least_turn.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tether/math/so3.h"

namespace tether::geometry {
namespace {

using Eigen::Vector3d;

const Eigen::Matrix3d kYaw = math::ExpSO3({0, 0, 0.7});
const Eigen::Matrix3d kTilted = math::ExpSO3({0.3, 0, 0}) * math::ExpSO3({0, 0, 2.0});
const Eigen::Matrix3d kUpright = Eigen::Matrix3d::Identity();

TEST(LeastTurnTest, ABoxIsTurnedInFull) {
  const Shape box(Box{{0.1, 0.1, 0.1}});
  EXPECT_NEAR((LeastTurn(box, kUpright, kYaw) - Vector3d(0, 0, 0.7)).norm(), 0, 1e-12);
  const Vector3d turn = LeastTurn(box, kYaw, kTilted);
  EXPECT_TRUE((math::ExpSO3(turn) * kYaw).isApprox(kTilted, 1e-12));
}

TEST(LeastTurnTest, ARoundBodyOnlyTilts) {
  Shape mug(Cylinder{0.03, 0.1});
  mug.parts.push_back({Sphere{0.03}, math::Pose(Vector3d(0, 0, 0.05))});
  for (const Shape& shape : {Shape(Cylinder{0.03, 0.1}), Shape(Capsule{0.03, 0.1}), mug}) {
    EXPECT_NEAR(LeastTurn(shape, kUpright, kYaw).norm(), 0, 1e-12);
    EXPECT_NEAR((LeastTurn(shape, kYaw, kTilted) - Vector3d(0.3, 0, 0)).norm(), 0, 1e-9);
    const Eigen::Matrix3d flipped = math::ExpSO3({M_PI, 0, 0});
    EXPECT_NEAR(LeastTurn(shape, kUpright, flipped).norm(), M_PI, 1e-9);
  }
  EXPECT_EQ(LeastTurn(Shape(Sphere{0.03}), kYaw, kTilted).norm(), 0);
}

TEST(LeastTurnTest, WhatIsRoundBesideItsOriginIsNot) {
  Shape aside(Cylinder{0.03, 0.1});
  aside.parts[0].X_SP = math::Pose(Vector3d(0.02, 0, 0));
  EXPECT_NEAR(LeastTurn(aside, kUpright, kYaw).norm(), 0.7, 1e-12);
  Shape crossed(Cylinder{0.03, 0.1});
  crossed.parts.push_back({Capsule{0.01, 0.2}, math::Pose(math::ExpSO3({M_PI / 2, 0, 0}), Vector3d::Zero())});
  EXPECT_NEAR(LeastTurn(crossed, kUpright, kYaw).norm(), 0.7, 1e-12);
}

}  // namespace
}  // namespace tether::geometry
