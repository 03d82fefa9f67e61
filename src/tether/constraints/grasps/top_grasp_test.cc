#include "tether/constraints/grasps/top_grasp.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/geometry/hull/polytope.h"
#include "tether/geometry/polygon/support.h"

namespace tether::constraints {
namespace {

using Eigen::Vector3d;
using math::Pose;

/// An upright prism over a regular polygon whose opposite sides are `across` apart.
geometry::Shape Prism(int sides, double across, double height) {
  std::vector<Vector3d> points;
  const double radius = 0.5 * across / std::cos(std::numbers::pi / sides);
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.5) / sides;
    for (const double z : {-height / 2, height / 2})
      points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
  }
  return geometry::Shape(
      std::vector<geometry::Part>{geometry::CentredPart(*geometry::MakeHull(points).hull, Pose())});
}

TEST(TopGraspTest, HullsAreHeldByOppositeSides) {
  const auto model = robot::Model::Load("j2n6s300");
  for (const int sides : {4, 6, 8}) {
    for (const double yaw : {0.0, 0.4, 2.5}) {
      const geometry::Shape prism = Prism(sides, 0.04, 0.12);
      const Pose X_WO(math::RotationFromRpy({0, 0, yaw}), {0.4, 0.1, 0.06});
      const auto grasp = FindTopGrasp(*model, prism, X_WO, math::RotationFromRpy({std::numbers::pi, 0, 0}));
      ASSERT_TRUE(grasp) << sides;
      EXPECT_NEAR(grasp->width, 0.04, 1e-6);
      const Pose X_WH = X_WO * grasp->X_OH;
      EXPECT_NEAR(X_WH.R(2, 2), -1, 1e-9);
      EXPECT_LT((X_WH.p - X_WO.p).head<2>().norm(), 1e-6);
      // The fingers meet two sides squarely: the prism is nowhere narrower than along them.
      const Vector3d closing_O = grasp->X_OH.R.col(1);
      EXPECT_NEAR(geometry::Support(prism, closing_O) + geometry::Support(prism, -closing_O), 0.04, 1e-6);
    }
  }
}

TEST(TopGraspTest, WhatIsTooWideIsSaid) {
  const auto model = robot::Model::Load("j2n6s300");
  GraspFlaws flaws;
  EXPECT_FALSE(FindTopGrasp(*model, Prism(6, 0.08, 0.1), Pose(Vector3d(0.4, 0, 0.05)),
                            math::RotationFromRpy({std::numbers::pi, 0, 0}), {}, &flaws));
  EXPECT_THAT(flaws.Describe("prism"), ::testing::HasSubstr("prism is 8.0 cm wide"));
  EXPECT_TRUE(flaws.proved());
}

}  // namespace
}  // namespace tether::constraints
