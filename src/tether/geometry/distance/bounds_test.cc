#include "tether/geometry/distance/bounds.h"

#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/geometry/polygon/support.h"
#include "tether/math/pose.h"

namespace tether::geometry {
namespace {

using Eigen::Vector3d;

math::Pose RandomPose(Random& random) {
  const Eigen::Quaterniond q(random.Normal(), random.Normal(), random.Normal(), random.Normal());
  return {q.normalized().toRotationMatrix(),
          Vector3d(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1))};
}

// An axis-aligned box is tight: it reaches as far as the shape along each axis, both ways.
TEST(BoundingBoxTest, ReachesAsFarAsTheShape) {
  Random random(7);
  std::vector<Vector3d> points;
  for (int i = 0; i < 20; ++i) points.emplace_back(random.Normal(), random.Normal(), random.Normal());
  const std::vector<Primitive> primitives = {Box{Vector3d(0.1, 0.2, 0.3)}, Sphere{0.2}, Capsule{0.1, 0.4},
                                             Cylinder{0.1, 0.4}, *MakeHull(points).hull};
  for (const Primitive& primitive : primitives) {
    for (int i = 0; i < 50; ++i) {
      const math::Pose X_WP = i == 0 ? math::Pose() : RandomPose(random);
      const Aabb box = BoundingBox(primitive, X_WP);
      Shape shape;
      shape.parts.push_back({primitive, X_WP});
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(box.upper[axis], Support(shape, Vector3d::Unit(axis)), 1e-12);
        EXPECT_NEAR(box.lower[axis], -Support(shape, Vector3d(-Vector3d::Unit(axis))), 1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace tether::geometry
