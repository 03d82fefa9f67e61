#include "tether/geometry/polygon/support.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "testing/geometry/slow_distance.h"
#include "tether/common/random.h"
#include "tether/geometry/hull/polytope.h"

namespace tether::geometry {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using math::Pose;
using std::numbers::pi;

Vector3d RandomDirection(Random& random) {
  return Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
}

/// Two capsules of radius 1 cm in the plane z = 0, meeting at a corner.
Shape Hook() {
  return Shape(
      {{Capsule{0.01, 0.3}, Pose(math::RotationFromRpy({0, 0.5 * pi, 0}), Vector3d::Zero())},
       {Capsule{0.01, 0.1}, Pose(math::RotationFromRpy({0.5 * pi, 0, 0}), Vector3d(0.15, 0.05, 0))}});
}

TEST(SupportTest, AgreesWithItsPointAndTheReference) {
  Random random(1);
  const std::vector<Primitive> solids = {Box{{0.3, 0.12, 0.05}}, Sphere{0.07}, Capsule{0.02, 0.25},
                                         Cylinder{0.05, 0.12}};
  for (const Primitive& solid : solids) {
    for (int i = 0; i < 100; ++i) {
      const Vector3d d = random.Uniform(0.1, 3) * RandomDirection(random);
      EXPECT_NEAR(Support(solid, d), SlowSupport(solid, d), 1e-14);
      EXPECT_NEAR(Support(solid, d), d.dot(SupportPoint(solid, d)), 1e-14);
      EXPECT_LT(SlowSurfaceMiss(solid, SupportPoint(solid, d)), 1e-14);
    }
  }
  for (int i = 0; i < 100; ++i) {
    const Vector3d d = RandomDirection(random);
    EXPECT_NEAR(Support(Hook(), d), d.dot(SupportPoint(Hook(), d)), 1e-14);
  }
}

TEST(SupportPolygonTest, HasTheShapeThatFacesTheDirection) {
  const FlatFacet box = SupportPolygon(Shape(Box{{0.2, 0.3, 0.1}}), {0, 0, -2});
  ASSERT_EQ(box.polygon.size(), 4u);
  EXPECT_NEAR(box.offset, 0.05, 1e-15);
  EXPECT_NEAR(Area(box.polygon), 0.06, 1e-12);

  const FlatFacet disc = SupportPolygon(Shape(Cylinder{0.1, 0.2}), {0, 0, 1});
  EXPECT_EQ(disc.polygon.size(), 32u);
  EXPECT_NEAR(Area(disc.polygon), pi * 0.01, 0.01 * pi * 0.01);

  EXPECT_EQ(SupportPolygon(Shape(Capsule{0.01, 0.2}), {1, 0, 0}).polygon.size(), 2u);
  EXPECT_EQ(SupportPolygon(Shape(Capsule{0.01, 0.2}), {1, 0, 0.1}).polygon.size(), 1u);
  EXPECT_EQ(SupportPolygon(Shape(Cylinder{0.01, 0.2}), {1, 1, 0}).polygon.size(), 2u);
  EXPECT_EQ(SupportPolygon(Shape(Sphere{0.1}), {1, 1, 0}).polygon.size(), 1u);
  EXPECT_EQ(SupportPolygon(Hook(), {0, 0, 1}).polygon.size(), 3u);
}

TEST(SupportPolygonTest, FrameIsRightHandedAndPointsLieOnThePlane) {
  Random random(2);
  const Shape shapes[] = {Hook(), Shape(Box{{0.2, 0.3, 0.1}}), Shape(Cylinder{0.1, 0.2})};
  for (const Shape& shape : shapes) {
    for (int i = 0; i < 40; ++i) {
      const Vector3d d =
          i < 6 ? Vector3d((i % 2 == 0 ? 1 : -1) * Vector3d::Unit(i / 2)) : RandomDirection(random);
      const FlatFacet facet = SupportPolygon(shape, d);
      EXPECT_LT((facet.axis_x.cross(facet.axis_y) - facet.normal).norm(), 1e-12);
      EXPECT_GE(Area(facet.polygon), 0);
      ASSERT_EQ(facet.points.size(), facet.polygon.size());
      for (size_t k = 0; k < facet.points.size(); ++k) {
        EXPECT_NEAR(facet.points[k].dot(facet.normal), Support(shape, facet.normal), 1e-12);
        EXPECT_LT((facet.Project(facet.points[k]) - facet.polygon[k]).norm(), 1e-12);
      }
    }
  }
}

TEST(RestingFacesTest, BoxHasSixSortedByStability) {
  const std::vector<FlatFacet> faces = RestingFaces(Shape(Box{{0.2, 0.3, 0.1}}), Vector3d::Zero());
  ASSERT_EQ(faces.size(), 6u);
  EXPECT_LT((faces[0].normal - Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT((faces[1].normal + Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_NEAR(faces[0].margin, 0.1, 1e-12);
  EXPECT_NEAR(faces[5].margin, 0.05, 1e-12);
}

TEST(RestingFacesTest, RoundSolidsRoll) {
  EXPECT_TRUE(RestingFaces(Shape(Sphere{0.1}), Vector3d::Zero()).empty());
  EXPECT_TRUE(RestingFaces(Shape(Capsule{0.1, 0.2}), Vector3d::Zero()).empty());
  EXPECT_EQ(RestingFaces(Shape(Cylinder{0.1, 0.2}), Vector3d::Zero()).size(), 2u);
}

TEST(RestingFacesTest, HookLiesFlatOnEitherSideOnly) {
  const Shape hook = Hook();
  const std::vector<FlatFacet> faces = RestingFaces(hook, CentreOfMass(hook));
  ASSERT_EQ(faces.size(), 2u);
  for (const FlatFacet& face : faces) {
    EXPECT_NEAR(std::abs(face.normal.z()), 1, 1e-12);
    EXPECT_NEAR(face.offset, 0.01, 1e-12);
    EXPECT_EQ(face.polygon.size(), 3u);
    EXPECT_GT(face.margin, 0.005);
  }
}

TEST(RestingFacesTest, BoardOnUnequalBallsTiltsByItsRadii) {
  // Three balls in a row and one aside: the plane under them is tilted, and exact.
  const Shape cart({{Sphere{0.02}, Pose(Vector3d(0, 0, 0))},
                    {Sphere{0.02}, Pose(Vector3d(0.2, 0, 0))},
                    {Sphere{0.03}, Pose(Vector3d(0.1, 0.2, 0))}});
  const std::vector<FlatFacet> faces = RestingFaces(cart, Vector3d(0.1, 0.07, 0));
  ASSERT_EQ(faces.size(), 2u);
  for (const FlatFacet& face : faces) {
    EXPECT_EQ(face.polygon.size(), 3u);
    for (const Part& part : cart.parts) {
      EXPECT_NEAR(face.normal.dot(part.X_SP.p) + std::get<Sphere>(part.primitive).radius, face.offset, 1e-10);
    }
  }
}

TEST(RestingFacesTest, TwoCylindersSideBySideRestOnTheirSides) {
  const Shape pair({{Cylinder{0.05, 0.2}, Pose(Vector3d(0.05, 0, 0))},
                    {Cylinder{0.03, 0.2}, Pose(Vector3d(-0.03, 0, 0))}});
  int on_side = 0;
  for (const FlatFacet& face : RestingFaces(pair, CentreOfMass(pair))) {
    if (std::abs(face.normal.z()) > 1e-9) continue;
    ++on_side;
    EXPECT_EQ(face.polygon.size(), 4u);
  }
  EXPECT_EQ(on_side, 2);
}

TEST(RestingFacesTest, SkipsFacesThatTheCentreOfMassOverhangs) {
  // A long arm on a small foot falls over.
  const Shape shape({{Box{{0.1, 0.1, 0.2}}, Pose()}, {Box{{0.6, 0.1, 0.1}}, Pose(Vector3d(0.25, 0, 0.15))}});
  for (const FlatFacet& face : RestingFaces(shape, CentreOfMass(shape))) {
    EXPECT_GT((face.normal + Vector3d::UnitZ()).norm(), 0.1) << "it would stand on its foot";
  }
}

TEST(RestingFacesTest, AreFacesOfTheHull) {
  Random random(3);
  for (int i = 0; i < 10; ++i) {
    Shape shape;
    for (int k = 0; k < 3; ++k) {
      const Pose X(math::ExpSO3(RandomDirection(random)), 0.2 * RandomDirection(random));
      const double size = random.Uniform(0.02, 0.2);
      const Primitive options[] = {Box{{size, 0.1, 0.05}}, Capsule{0.02, size}, Cylinder{size, 0.05}};
      shape.parts.push_back({options[random.Index(3)], X});
    }
    const std::vector<FlatFacet> faces = RestingFaces(shape, CentreOfMass(shape));
    EXPECT_GE(faces.size(), 1u);
    for (const FlatFacet& face : faces) {
      EXPECT_NEAR(Support(shape, face.normal), face.offset, 1e-12);
      EXPECT_GE(face.polygon.size(), 3u);
    }
  }
}

/// The outward normals of planes through three of the points with all others behind them, over which `centre`
/// is by more than `margin`.
std::vector<Vector3d> StableNormals(const std::vector<Vector3d>& points, const Vector3d& centre,
                                    double margin) {
  std::vector<Vector3d> normals;
  for (size_t i = 0; i < points.size(); ++i) {
    for (size_t j = i + 1; j < points.size(); ++j) {
      for (size_t k = j + 1; k < points.size(); ++k) {
        const Vector3d across = (points[j] - points[i]).cross(points[k] - points[i]);
        if (across.norm() < 1e-9) continue;
        for (const double sign : {1.0, -1.0}) {
          const Vector3d n = sign * across.normalized(), u = n.unitOrthogonal(), v = n.cross(u);
          std::vector<Vector2d> on_plane;
          bool behind = true;
          for (const Vector3d& p : points) {
            behind = behind && n.dot(p - points[i]) < 1e-9;
            if (std::abs(n.dot(p - points[i])) < 1e-9) on_plane.emplace_back(u.dot(p), v.dot(p));
          }
          if (behind && ContainmentMargin(ConvexHull(on_plane), {u.dot(centre), v.dot(centre)}) > margin)
            normals.push_back(n);
        }
      }
    }
  }
  return normals;
}

bool Contains(const std::vector<FlatFacet>& faces, const Vector3d& normal) {
  return std::any_of(faces.begin(), faces.end(),
                     [&](const FlatFacet& face) { return (face.normal - normal).norm() < 1e-5; });
}

TEST(RestingFacesTest, OfCompoundsNoneIsMissed) {
  Random random(7);
  for (int i = 0; i < 10; ++i) {
    // The faces of boxes and hulls touch their corners; those of balls of one size are given by their
    // centres.
    Shape corners, balls;
    std::vector<Vector3d> corner_points, ball_points;
    for (int k = 0; k < 3; ++k) {
      const Pose X(math::ExpSO3(RandomDirection(random)), 0.1 * RandomDirection(random));
      std::vector<Vector3d> points;
      if (k == 0) {
        for (int c = 0; c < 8; ++c)
          points.emplace_back(c & 1 ? 0.06 : -0.06, c & 2 ? 0.05 : -0.05, c & 4 ? 0.02 : -0.02);
        corners.parts.push_back({Box{{0.12, 0.1, 0.04}}, X});
      } else {
        for (int p = 0; p < 9; ++p) points.push_back(0.06 * RandomDirection(random));
        corners.parts.push_back({*MakeHull(points).hull, X});
      }
      for (const Vector3d& p : points) corner_points.push_back(X * p);
      balls.parts.push_back({Capsule{0.02, 0.08}, X});
      for (const double end : {-0.04, 0.04}) ball_points.push_back(X * Vector3d(0, 0, end));
    }
    for (const bool round : {false, true}) {
      const Shape& shape = round ? balls : corners;
      const Vector3d centre = CentreOfMass(shape);
      const std::vector<FlatFacet> faces = RestingFaces(shape, centre);
      const auto expected = StableNormals(round ? ball_points : corner_points, centre, 1e-4);
      EXPECT_GE(expected.size(), 1u);
      for (const Vector3d& normal : expected)
        EXPECT_TRUE(Contains(faces, normal)) << i << " " << normal.transpose();
    }
  }
}

TEST(PolygonTest, HullContainsItsPointsAndDropsStraightCorners) {
  EXPECT_EQ(ConvexHull({{0, 0}, {1, 0}, {2, 0}, {2, 2}, {1, 1}, {0, 2}, {0, 1}, {0, 0}}).size(), 4u);
  EXPECT_EQ(ConvexHull({{0, 0}, {1, 1}, {2, 2}}).size(), 2u);
  EXPECT_EQ(ConvexHull({{1, 1}, {1, 1}}).size(), 1u);
  Random random(4);
  for (int i = 0; i < 50; ++i) {
    std::vector<Vector2d> points;
    for (int k = 0; k < 30; ++k) points.emplace_back(random.Normal(), random.Normal());
    const Polygon hull = ConvexHull(points);
    EXPECT_GT(Area(hull), 0);
    for (const Vector2d& p : points) EXPECT_GE(ContainmentMargin(hull, p), -1e-12);
    for (const HalfPlane& edge : EdgeHalfPlanes(hull)) {
      for (const Vector2d& p : points) EXPECT_LE(edge.normal.dot(p), edge.offset + 1e-12);
    }
  }
}

TEST(PolygonTest, ShrinkKeepsTheMarginAndVanishes) {
  const Polygon square = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  EXPECT_NEAR(Area(Shrink(square, 0.1)), 0.64, 1e-12);
  EXPECT_TRUE(Shrink(square, 0.6).empty());
  const Polygon triangle = {{0, 0}, {4, 0}, {0, 3}};
  for (const Vector2d& p : Shrink(triangle, 0.5)) EXPECT_GE(ContainmentMargin(triangle, p), 0.5 - 1e-12);
  EXPECT_NEAR(ContainmentMargin(square, {0.5, 0.2}), 0.2, 1e-15);
  EXPECT_NEAR(ContainmentMargin(square, {2, 2}), -std::sqrt(2.0), 1e-15);
}

TEST(PolygonTest, FitsInsideFindsTheTurnThatFits) {
  const auto rectangle = [](double x, double y) { return Polygon{{0, 0}, {x, 0}, {x, y}, {0, y}}; };
  EXPECT_TRUE(FitsInside(rectangle(1, 2), rectangle(1, 2), 0)) << "exactly";
  EXPECT_FALSE(FitsInside(rectangle(1, 2), rectangle(2, 1), 0));
  const std::optional<Fit> turned = FitsInside(rectangle(1, 2), rectangle(2, 1));
  ASSERT_TRUE(turned);
  EXPECT_NEAR(std::abs(turned->yaw), 0.5 * pi, 1e-12);
  EXPECT_FALSE(FitsInside(rectangle(1, 2), rectangle(1.9, 1.9)));
  EXPECT_TRUE(FitsInside(rectangle(0.1, 1.3), rectangle(1, 1))) << "only along the diagonal";
  Random random(5);
  const Polygon outer = ConvexHull({{0, 0}, {3, 0.5}, {2, 2.5}, {0.3, 1.9}});
  for (int i = 0; i < 100; ++i) {
    const Polygon inner = rectangle(random.Uniform(0.2, 2), random.Uniform(0.2, 2));
    const double yaw = random.Uniform(-3, 3);
    if (const std::optional<Fit> fit = FitsInside(inner, outer, yaw)) {
      for (const Vector2d& p : Transform(inner, fit->yaw, fit->translation)) {
        EXPECT_GE(ContainmentMargin(outer, p), -1e-8);
      }
    }
  }
}

}  // namespace
}  // namespace tether::geometry
