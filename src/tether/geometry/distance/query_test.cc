#include "tether/geometry/distance/query.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "testing/geometry/slow_distance.h"
#include "tether/common/random.h"
#include "tether/geometry/distance/distance.h"
#include "tether/math/numeric_derivative.h"

namespace tether::geometry {
namespace {

using Eigen::Vector3d;
using math::Pose;

const std::vector<Primitive>& Examples() {
  static const std::vector<Primitive> examples = {Box{{0.3, 0.12, 0.05}}, Sphere{0.07}, Capsule{0.02, 0.25},
                                                  Cylinder{0.05, 0.12}};
  return examples;
}

Shape Compound() {
  return Shape({{Box{{0.2, 0.1, 0.1}}, Pose()},
                {Capsule{0.03, 0.2}, Pose(math::RotationFromRpy({0, 1.2, 0.3}), {0.15, 0, 0.02})},
                {Sphere{0.05}, Pose(Vector3d(-0.3, 0, 0))}});
}

Vector3d RandomVector(Random& random, double size) {
  return {random.Uniform(-size, size), random.Uniform(-size, size), random.Uniform(-size, size)};
}

Pose RandomPose(Random& random) {
  return Pose(math::ExpSO3(RandomVector(random, 2)), RandomVector(random, 0.3));
}

TEST(PointDistanceTest, IsTheDistanceToASphereOfNoRadius) {
  Random random(1);
  for (const Primitive& solid : Examples()) {
    for (int i = 0; i < 300; ++i) {
      const Pose X_WS = RandomPose(random);
      const Vector3d q = X_WS * RandomVector(random, 0.15);
      const PointDistance d = DistanceToPoint(solid, X_WS, q);
      EXPECT_NEAR(d.distance, SlowDistance(solid, X_WS, Sphere{0}, Pose(q)).distance, i < 20 ? 1e-7 : 1e300);
      EXPECT_NEAR(d.distance, SignedDistance(solid, X_WS, Sphere{0}, Pose(q)).distance, 1e-12);
      EXPECT_LT((d.p_W + d.distance * d.n_W - q).norm(), 1e-12);
      EXPECT_LT(SlowSurfaceMiss(solid, X_WS.Inverse() * d.p_W), 1e-12);
      EXPECT_NEAR(d.n_W.norm(), 1, 1e-12);
    }
  }
}

TEST(PointDistanceTest, DerivativeMatchesNumericDifferentiation) {
  Random random(2);
  std::vector<Shape> shapes(Examples().begin(), Examples().end());
  shapes.push_back(Compound());
  int compared = 0, skipped = 0;
  for (const Shape& shape : shapes) {
    for (int i = 0; i < 100; ++i) {
      const Pose X_WS = RandomPose(random);
      const Vector3d q = X_WS * RandomVector(random, 0.15);
      const PointDistance d = DistanceToPoint(shape, X_WS, q);
      bool kink = false;
      for (int axis = 0; axis < 6; ++axis) {
        const Vector3d near = q + (axis % 2 == 0 ? 1e-4 : -1e-4) * Vector3d::Unit(axis / 2);
        if ((DistanceToPoint(shape, X_WS, near).n_W - d.n_W).norm() > 0.05) kink = true;
      }
      if (kink) {
        ++skipped;
        continue;
      }
      ++compared;
      const PointDistanceDerivative exact = DifferentiatePointDistance(d, X_WS);
      const Eigen::MatrixXd dQ = math::NumericJacobian(
          [&](const Eigen::VectorXd& x) {
            return Eigen::VectorXd::Constant(1, DistanceToPoint(shape, X_WS, x).distance);
          },
          q, 1e-5);
      const Eigen::MatrixXd dS = math::NumericPoseJacobian(
          [&](const Pose& X) { return Eigen::VectorXd::Constant(1, DistanceToPoint(shape, X, q).distance); },
          X_WS, 1e-5);
      EXPECT_LT((exact.dQ - dQ).norm(), 1e-6);
      EXPECT_LT((exact.dS - dS).norm(), 1e-6);
    }
  }
  std::printf("point derivatives: %d compared, %d skipped at kinks\n", compared, skipped);
  EXPECT_LT(skipped, 30);
}

TEST(PointDistanceTest, NamesThePartThatIsNearest) {
  EXPECT_EQ(DistanceToPoint(Compound(), Pose(), {-0.4, 0, 0}).part, 2);
  EXPECT_EQ(DistanceToPoint(Compound(), Pose(), {0, 0, 0.2}).part, 0);
}

TEST(RayTest, HitsWhereSphereTracingDoes) {
  Random random(3);
  std::vector<Shape> shapes(Examples().begin(), Examples().end());
  shapes.push_back(Compound());
  int hits = 0;
  for (const Shape& shape : shapes) {
    for (int i = 0; i < 300; ++i) {
      const Pose X_WS = RandomPose(random);
      const Vector3d origin =
          X_WS * (Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized() * 0.6);
      const Vector3d direction = X_WS * RandomVector(random, 0.15) - origin;
      const std::optional<RayHit> hit = CastRay(shape, X_WS, origin, direction);
      // Outside, a step as long as the distance never passes the surface.
      double t = 0;
      double distance = 1;
      for (int step = 0; step < 3000 && t < 5 && distance > 1e-9; ++step) {
        distance = DistanceToPoint(shape, X_WS, origin + t * direction).distance;
        t += distance / direction.norm();
      }
      const bool traced = distance <= 1e-9;
      if (!traced && distance < 1e-4) continue;  // it grazes
      ASSERT_EQ(hit.has_value(), traced);
      if (!hit) continue;
      ++hits;
      EXPECT_NEAR(hit->t, t, 1e-5);
      EXPECT_FALSE(hit->from_inside);
      EXPECT_LT((hit->p_W - origin - hit->t * direction).norm(), 1e-12);
      const PointDistance there = DistanceToPoint(shape, X_WS, hit->p_W + 1e-7 * hit->n_W);
      EXPECT_NEAR(there.distance, 1e-7, 1e-9);
      EXPECT_EQ(there.part, hit->part);
      EXPECT_LE(hit->n_W.dot(direction), 1e-12);
    }
  }
  EXPECT_GT(hits, 300);
}

TEST(RayTest, FromInsideItReportsTheExitOrNothing) {
  const Shape box(Box{{0.2, 0.2, 0.2}});
  const Pose X_WS(Vector3d(1, 0, 0));
  const std::optional<RayHit> exit = CastRay(box, X_WS, {1, 0, 0}, {0, 0, 2});
  ASSERT_TRUE(exit);
  EXPECT_TRUE(exit->from_inside);
  EXPECT_NEAR(exit->t, 0.05, 1e-15);
  EXPECT_LT((exit->n_W - Vector3d::UnitZ()).norm(), 1e-15);
  EXPECT_FALSE(CastRay(box, X_WS, {1, 0, 0}, {0, 0, 2}, RayStart::kIgnore));
  EXPECT_FALSE(CastRay(box, X_WS, {1, 0, -1}, {0, 0, -1})) << "behind the origin";
  EXPECT_FALSE(CastRay(box, X_WS, {1, 0, -1}, {0, 0, 1}, RayStart::kExit, 0.5)) << "beyond t_max";
  EXPECT_FALSE(CastRay(box, X_WS, {1, 0, -1}, {0, 0, 0}));
  EXPECT_FALSE(CastRay(box, X_WS, {1, 0, -1}, {0, 0, std::numeric_limits<double>::quiet_NaN()}));
}

TEST(RayTest, LeavesACompoundWhereTheUnionEnds) {
  // Listed from far to near, so that one pass over the parts does not see the whole stretch.
  const Shape row({{Box{{0.1, 0.1, 0.1}}, Pose(Vector3d(0.2, 0, 0))},
                   {Box{{0.1, 0.1, 0.1}}, Pose(Vector3d(0.1, 0, 0))},
                   {Box{{0.11, 0.1, 0.1}}, Pose()},
                   {Sphere{0.05}, Pose(Vector3d(0.4, 0, 0))}});
  const std::optional<RayHit> exit = CastRay(row, Pose(), {0, 0, 0}, {1, 0, 0});
  ASSERT_TRUE(exit);
  EXPECT_TRUE(exit->from_inside);
  EXPECT_NEAR(exit->t, 0.25, 1e-15);
  EXPECT_EQ(exit->part, 0);
  const std::optional<RayHit> enter = CastRay(row, Pose(), {0.3, 0, 0}, {1, 0, 0});
  ASSERT_TRUE(enter);
  EXPECT_EQ(enter->part, 3);
  EXPECT_NEAR(enter->t, 0.05, 1e-15);
}

}  // namespace
}  // namespace tether::geometry
