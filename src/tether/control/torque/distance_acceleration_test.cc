#include "tether/control/torque/distance_acceleration.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tether/common/random.h"

namespace tether::control {
namespace {

using Eigen::Vector3d;
using geometry::Primitive;
using math::Pose;

/// A body with a velocity and an acceleration of its origin, and a constant angular velocity.
struct Moving {
  Primitive shape;
  Pose X;
  Vector3d v, a, w;

  Pose At(double t) const { return {math::ExpSO3(w * t) * X.R, X.p + v * t + 0.5 * a * t * t}; }
  PointMotion MotionOf(const Vector3d& p_W, double t) const {
    return {v + a * t + w.cross(p_W - At(t).p), w};
  }
  /// Of the material point that is at p now.
  Vector3d AccelerationOf(const Vector3d& p_W) const { return a + w.cross(w.cross(p_W - X.p)); }
};

geometry::Distance DistanceAt(const Moving& a, const Moving& b, double t) {
  return geometry::SignedDistance(a.shape, a.At(t), b.shape, b.At(t));
}

double RateAt(const Moving& a, const Moving& b, double t) {
  const geometry::Distance d = DistanceAt(a, b, t);
  return d.n_W.dot(b.MotionOf(d.p_WB, t).v - a.MotionOf(d.p_WA, t).v);
}

double AccelerationOf(const Moving& a, const Moving& b) {
  const geometry::Distance d = DistanceAt(a, b, 0);
  return d.n_W.dot(b.AccelerationOf(d.p_WB) - a.AccelerationOf(d.p_WA)) +
         SlidingAcceleration(d, a.shape, a.X, a.MotionOf(d.p_WA, 0), b.shape, b.X, b.MotionOf(d.p_WB, 0));
}

Moving Draw(const Primitive& shape, Random& random) {
  const auto vector = [&](double most) {
    return Vector3d(random.Uniform(-most, most), random.Uniform(-most, most), random.Uniform(-most, most));
  };
  return {shape, Pose(math::ExpSO3(vector(2)), vector(0.3)), vector(1), vector(2), vector(2)};
}

/// Whether the feature does not change about t = 0: the numeric derivatives of both sides agree.
bool IsSmooth(const Moving& a, const Moving& b, double step) {
  const double forward = (RateAt(a, b, step) - RateAt(a, b, 0)) / step;
  const double backward = (RateAt(a, b, 0) - RateAt(a, b, -step)) / step;
  return std::abs(forward - backward) < 1e-3 * (1 + std::abs(forward));
}

// Every pair of kinds, at random: vertices, edges, faces, rims, sides.
TEST(SlidingAcceleration, IsTheDerivativeOfTheRate) {
  const std::vector<Primitive> shapes = {geometry::Box{{0.1, 0.2, 0.3}}, geometry::Sphere{0.08},
                                         geometry::Capsule{0.05, 0.3}, geometry::Cylinder{0.06, 0.2}};
  Random random(5);
  for (const Primitive& first : shapes) {
    for (const Primitive& second : shapes) {
      int looked_at = 0;
      for (int trial = 0; trial < 200; ++trial) {
        const Moving a = Draw(first, random), b = Draw(second, random);
        const geometry::Distance d = DistanceAt(a, b, 0);
        const double step = 1e-5;
        if (d.distance < 0.005 || !IsSmooth(a, b, step)) continue;
        ++looked_at;
        const double numeric = (RateAt(a, b, step) - RateAt(a, b, -step)) / (2 * step);
        const double finer = 5 * (RateAt(a, b, step / 10) - RateAt(a, b, -step / 10)) / step;
        // Lines that are nearly parallel: differences say nothing.
        if (std::abs(numeric - finer) > 1e-4 * (1 + std::abs(numeric))) continue;
        EXPECT_NEAR(AccelerationOf(a, b), numeric, 2e-3 * (1 + std::abs(numeric)))
            << geometry::KindName(first) << " and " << geometry::KindName(second) << ", trial " << trial;
      }
      EXPECT_GT(looked_at, 40) << geometry::KindName(first) << " and " << geometry::KindName(second);
    }
  }
}

// A box over a wider one: the upper one's face turns the normal, or the lower one's does.
TEST(SlidingAcceleration, KnowsTheFaceFromTheVertex) {
  Random random(2);
  for (int trial = 0; trial < 50; ++trial) {
    Moving table = Draw(geometry::Box{{1, 1, 0.1}}, random),
           box = Draw(geometry::Box{{0.1, 0.1, 0.1}}, random);
    table.X = Pose();
    box.X = Pose(math::ExpSO3(Vector3d(0.3, 0.2 + 0.01 * trial, 0.1)), Vector3d(0.1, 0.1, 0.2));
    const double numeric = (RateAt(table, box, 1e-5) - RateAt(table, box, -1e-5)) / 2e-5;
    EXPECT_NEAR(AccelerationOf(table, box), numeric, 1e-4 * (1 + std::abs(numeric)));
    const double other = (RateAt(box, table, 1e-5) - RateAt(box, table, -1e-5)) / 2e-5;
    EXPECT_NEAR(AccelerationOf(box, table), other, 1e-4 * (1 + std::abs(other)));
  }
}

// Flat on flat the distance has a kink: what is said must be finite, and of a size that a vertex has.
TEST(SlidingAcceleration, IsFiniteAtAKink) {
  Moving table{geometry::Box{{1, 1, 0.1}}, Pose(), Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
  Moving box{geometry::Box{{0.1, 0.1, 0.1}}, Pose(Vector3d(0, 0, 0.2)), Vector3d(0.5, 0, 0), Vector3d::Zero(),
             Vector3d(1, 2, 3)};
  EXPECT_LT(std::abs(AccelerationOf(table, box)), 10);
  EXPECT_LT(std::abs(AccelerationOf(box, table)), 10);
}

}  // namespace
}  // namespace tether::control
