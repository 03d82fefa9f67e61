#include "tether/motion/kernel/sphere_cover.h"

#include <gtest/gtest.h>

#include "testing/motion/random_scene.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/distance/query.h"

namespace tether::motion::internal {
namespace {

using Eigen::Vector3d;

TEST(SphereCoverTest, CoversTheSolidAndFillsItFromWithin) {
  Random random(3);
  for (int kind = 0; kind < 40; ++kind) {
    const geometry::Primitive primitive = RandomPrimitive(random, kind);
    const std::vector<CoverSphere> cover = CoverWithSpheres(primitive);
    ASSERT_FALSE(cover.empty());
    EXPECT_LT(cover.size(), 400u);
    const double radius = geometry::BoundingRadius(primitive);
    for (int i = 0; i < 500; ++i) {
      const Vector3d p = RandomPoint(random, -radius, radius);
      const double distance = geometry::DistanceToPoint(primitive, math::Pose(), p).distance;
      bool covered = false, within = false;
      for (const CoverSphere& sphere : cover) {
        covered = covered || (p - sphere.p).norm() <= sphere.outer + 1e-9;
        within = within || (p - sphere.p).norm() < sphere.inner - 1e-6;
      }
      if (distance <= 0) {
        EXPECT_TRUE(covered) << geometry::KindName(primitive) << " " << p.transpose();
      }
      if (within) {
        EXPECT_LE(distance, 1e-9) << geometry::KindName(primitive) << " " << p.transpose();
      }
    }
  }
}

// A finger's cover must not stick out by much, or nothing could be grasped.
TEST(SphereCoverTest, CapsulesAreCoveredTightly) {
  for (const CoverSphere& sphere : CoverWithSpheres(geometry::Capsule{0.05, 0.2})) {
    EXPECT_LT(sphere.outer, 0.0525);
    EXPECT_EQ(sphere.inner, 0.05);
  }
}

}  // namespace
}  // namespace tether::motion::internal
