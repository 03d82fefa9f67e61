#include "tether/constraints/core/field_function.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tether/common/random.h"

namespace tether::constraints {
namespace {

using Eigen::Vector3d;
using math::Pose;

double ValueAt(const PoseFunctionPtr& function, const Vector3d& p_BQ, int row = 0) {
  const std::array<Pose, 2> X{Pose(), Pose(p_BQ)};
  Eigen::VectorXd r(function->size());
  function->Evaluate(X, r, nullptr);
  return r[row];
}

// ERRATA B1: at the start the constraint is exactly active, at the plane it is the disc, also where the
// printed form has a singularity (start above the rim) or a negative height (start within the disc).
TEST(PointConeTest, LeadsFromTheStartToTheDisc) {
  Random random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const double radius = random.Uniform(0.01, 0.1), height = random.Uniform(0.05, 1);
    const double start_radius = trial == 0 ? radius : random.Uniform(0, 0.5);
    const double angle = random.Uniform(0, 2 * M_PI);
    const Vector3d across(std::cos(angle), std::sin(angle), 0), up(0, 0, 1);
    const auto cone = MakePointCone(radius, start_radius * across + height * up, Vector3d::Zero());
    EXPECT_NEAR(ValueAt(cone, start_radius * across + height * up), std::min(0.0, start_radius - radius),
                1e-12);
    EXPECT_NEAR(ValueAt(cone, radius * across), 0, 1e-12);
    EXPECT_GT(ValueAt(cone, (radius + 0.01) * across), 0.009);
    const double share = random.Uniform(0, 1);
    const double middle = radius + std::max(0.0, start_radius - radius) * share;
    EXPECT_NEAR(ValueAt(cone, middle * across + share * height * up), 0, 1e-12);
  }
}

TEST(PointConeTest, TheMirrorConeBelowTheApexIsForbidden) {
  const auto cone = MakePointCone(0.1, {0.5, 0, 1}, Vector3d::Zero());
  EXPECT_NEAR(ValueAt(cone, {0, 0, -0.25}), 0, 1e-12);  // the apex: 0.1 / 0.4 below the plane
  EXPECT_NEAR(ValueAt(cone, {0.2, 0, -0.75}), 0.2, 1e-12);
}

TEST(FrustumTest, HoldsTheStartAndEndsAtTheRectangle) {
  const Vector3d start(0.5, -0.02, 0.4);
  const auto frustum = MakeFrustum({0.1, 0.2}, start, Vector3d::Zero());
  ASSERT_EQ(frustum->size(), 4);
  for (int row = 0; row < 4; ++row) {
    EXPECT_LE(ValueAt(frustum, start, row), 1e-12);
    EXPECT_LE(ValueAt(frustum, {0.049, 0.099, 0}, row), 0);
  }
  EXPECT_GT(ValueAt(frustum, {0.06, 0, 0}, 0), 0);
  EXPECT_GT(ValueAt(frustum, {0, -0.11, 0}, 3), 0.0099);
}

TEST(LineDistanceTest, IsTheLeastOverPointsOfBothLines) {
  Random random(2);
  for (int trial = 0; trial < 50; ++trial) {
    const auto vector = [&] { return Vector3d(random.Normal(), random.Normal(), random.Normal()); };
    const Line b{vector(), vector().normalized()};
    const Line a{vector(), trial % 5 == 0 ? b.u : vector().normalized()};
    const double distance = ValueAt(MakeLineDistance(b, a, 0, 1), Vector3d::Zero());
    // By a slow search: the distance of a point of A from line B is convex along A.
    const auto to_b = [&](double t) {
      const Vector3d d = a.p + t * a.u - b.p;
      return (d - b.u * b.u.dot(d)).norm();
    };
    double low = -1e3, high = 1e3;
    for (int i = 0; i < 200; ++i) {
      const double third = (high - low) / 3;
      (to_b(low + third) < to_b(high - third) ? high : low) +=
          to_b(low + third) < to_b(high - third) ? -third : third;
    }
    EXPECT_NEAR(distance, to_b(0.5 * (low + high)), 1e-7);
  }
}

}  // namespace
}  // namespace tether::constraints
