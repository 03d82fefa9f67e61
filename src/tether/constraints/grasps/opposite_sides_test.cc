#include "tether/constraints/grasps/opposite_sides.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/geometry/distance/query.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/math/pose.h"

namespace tether::constraints {
namespace {

using Eigen::Vector3d;
using geometry::Part;
using math::Pose;
using std::numbers::pi;

constexpr double kFinger = 0.01;

Part HullPart(const std::vector<Vector3d>& points, const Pose& X_SP = {}) {
  return geometry::CentredPart(*geometry::MakeHull(points).hull, X_SP);
}

/// An upright prism over a regular polygon whose sides are `across_flats` / 2 from the middle.
std::vector<Vector3d> Prism(int sides, double across_flats, double height) {
  std::vector<Vector3d> points;
  const double radius = 0.5 * across_flats / std::cos(pi / sides);
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * pi * (i + 0.5) / sides;
    for (const double z : {0.0, height})
      points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
  }
  return points;
}

std::vector<Vector3d> BoxCorners(const Vector3d& size) {
  std::vector<Vector3d> points;
  for (int i = 0; i < 8; ++i) {
    const Vector3d sign(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
    points.emplace_back(sign.cwiseProduct(size));
  }
  return points;
}

Pose RandomPose(Random& random) {
  math::Vector6d delta;
  for (int i = 0; i < 6; ++i) delta[i] = random.Uniform(-1, 1);
  return math::ExpSE3(delta);
}

/// A line along `closing` through any point within the bounds leaves the part through one of two nearly
/// parallel sides at either end, and the centre is such a point, midway between them.
void ExpectHolds(const Part& part, const OppositeSides& sides, const Vector3d& approach, Random& random) {
  EXPECT_NEAR(sides.closing.norm(), 1, 1e-12);
  EXPECT_NEAR(sides.closing.dot(approach), 0, 1e-9);
  for (const FaceEdge& bound : sides.bounds) {
    EXPECT_LT(bound.normal.dot(sides.centre), bound.offset);
    EXPECT_NEAR(bound.normal.dot(sides.closing), 0, 1e-9);
  }
  double reach[2];
  for (int trial = 0; trial < 50; ++trial) {
    Vector3d p = sides.centre;
    if (trial > 0) p += 0.05 * Vector3d(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1));
    p += sides.closing * sides.closing.dot(sides.centre - p);
    bool within = true;
    for (const FaceEdge& bound : sides.bounds) within = within && bound.normal.dot(p) <= bound.offset;
    if (!within) continue;
    for (const int sign : {1, -1}) {
      const Vector3d outward = sign * sides.closing;
      const auto hit = geometry::CastRay(part.primitive, part.X_SP, p, outward);
      ASSERT_TRUE(hit && hit->from_inside);
      EXPECT_LT(std::acos(std::min(1.0, hit->n_W.dot(outward))), kNearlyParallel + 1e-9);
      if (trial == 0) reach[sign > 0 ? 0 : 1] = hit->t;
    }
  }
  EXPECT_NEAR(reach[0], reach[1], 0.1 * sides.width);
}

TEST(OppositeSidesTest, ABoxOfCornersIsTakenAsABox) {
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Pose X = RandomPose(random);
    const Vector3d size(random.Uniform(0.02, 0.2), random.Uniform(0.02, 0.2), random.Uniform(0.02, 0.2));
    const Part part = HullPart(BoxCorners(size), X);
    const Vector3d approach = -X.R.col(2);
    const auto all = FindOppositeSides(part, approach, kFinger);
    ASSERT_EQ(all.size(), 2u);
    for (const OppositeSides& sides : all) {
      const int axis = std::abs(sides.closing.dot(X.R.col(0))) > 0.5 ? 0 : 1;
      EXPECT_NEAR(sides.width, size[axis], 1e-6);
      EXPECT_LT((sides.centre - X.p).norm(), 1e-6);
      ExpectHolds(part, sides, approach, random);
    }
  }
}

TEST(OppositeSidesTest, APrismHasAPairForEveryTwoSides) {
  Random random(2);
  for (const int n : {4, 6, 8, 12, 32, 60}) {
    const Pose X = RandomPose(random);
    const Part part = HullPart(Prism(n, 0.05, 0.04), X);
    const auto all = FindOppositeSides(part, -X.R.col(2), kFinger);
    ASSERT_EQ(all.size(), static_cast<size_t>(n / 2)) << n;
    for (const OppositeSides& sides : all) {
      EXPECT_NEAR(sides.width, 0.05, 1e-6) << n;
      ExpectHolds(part, sides, -X.R.col(2), random);
    }
  }
}

TEST(OppositeSidesTest, WhatHasNoTwoOppositeSidesCannotBeHeld) {
  EXPECT_TRUE(FindOppositeSides(HullPart(Prism(3, 0.05, 0.04)), -Vector3d::UnitZ(), kFinger).empty());
  EXPECT_TRUE(FindOppositeSides(HullPart({{0, 0, 0}, {0.05, 0, 0}, {0, 0.05, 0}, {0, 0, 0.05}}),
                                -Vector3d::UnitZ(), kFinger)
                  .empty());
  // The same prism, lying on a side, is held by its ends.
  const Part lying = HullPart(Prism(3, 0.05, 0.04), Pose(math::RotationFromRpy({pi / 2, 0, 0}), {0, 0, 0}));
  const auto ends = FindOppositeSides(lying, -Vector3d::UnitZ(), kFinger);
  ASSERT_EQ(ends.size(), 1u);
  EXPECT_NEAR(ends[0].width, 0.04, 1e-6);
}

TEST(OppositeSidesTest, ChamfersAreNoSides) {
  std::vector<Vector3d> points;
  for (const double z : {0.0, 0.04}) {
    for (const double sx : {-1.0, 1.0}) {
      for (const double sy : {-1.0, 1.0}) {
        points.emplace_back(sx * 0.025, sy * 0.023, z);
        points.emplace_back(sx * 0.023, sy * 0.025, z);
      }
    }
  }
  EXPECT_EQ(FindOppositeSides(HullPart(points), -Vector3d::UnitZ(), kFinger).size(), 2u);
}

TEST(OppositeSidesTest, ASkewBlockIsHeldWhereItsSidesFaceEachOther) {
  Random random(3);
  // A parallelogram seen from above: the sides across y overlap for 6 − shift of their 6 cm.
  for (const double shift : {0.02, 0.04, 0.07}) {
    std::vector<Vector3d> points;
    for (const double z : {0.0, 0.04}) {
      for (const double x : {0.0, 0.06}) {
        points.emplace_back(x, 0.0, z);
        points.emplace_back(x + shift, 0.05, z);
      }
    }
    const Part part = HullPart(points);
    double width_y = 0;
    for (const OppositeSides& sides : FindOppositeSides(part, -Vector3d::UnitZ(), kFinger)) {
      if (std::abs(sides.closing.y()) < 0.999) continue;
      width_y = sides.width;
      EXPECT_NEAR(sides.centre.x(), 0.5 * (shift + 0.06), 1e-6);
      ExpectHolds(part, sides, -Vector3d::UnitZ(), random);
    }
    EXPECT_NEAR(width_y, shift < 0.06 ? 0.05 : 0, 1e-6);
  }
}

TEST(OppositeSidesTest, SlightlyTaperedSidesCountSteepOnesDoNot) {
  Random random(4);
  for (const double taper : {0.05, 0.3}) {
    std::vector<Vector3d> points;
    for (const double z : {0.0, 0.04}) {
      for (const double sx : {-1.0, 1.0}) {
        for (const double sy : {-1.0, 1.0}) points.emplace_back(sx * (0.02 - taper * z), sy * 0.03, z);
      }
    }
    const Part part = HullPart(points);
    bool along_x = false;
    for (const OppositeSides& sides : FindOppositeSides(part, -Vector3d::UnitZ(), kFinger)) {
      along_x = along_x || std::abs(sides.closing.x()) > 0.999;
      ExpectHolds(part, sides, -Vector3d::UnitZ(), random);
    }
    EXPECT_EQ(along_x, taper < 0.1);
  }
}

}  // namespace
}  // namespace tether::constraints
