#include "tether/geometry/hull/polytope.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "testing/geometry/slow_distance.h"
#include "tether/common/random.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/distance/distance.h"
#include "tether/geometry/distance/query.h"
#include "tether/geometry/polygon/support.h"
#include "tether/math/numeric_derivative.h"

namespace tether::geometry {
namespace {

using Eigen::Vector3d;
using math::Pose;

std::vector<Vector3d> BoxCorners(const Vector3d& size) {
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    corners.push_back(0.5 * size.cwiseProduct(Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
  }
  return corners;
}

std::vector<Vector3d> Cloud(int count, Random& random) {
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i)
    points.emplace_back(random.Normal(), 0.5 * random.Normal(), random.Normal());
  return points;
}

Hull MustMake(const std::vector<Vector3d>& points) { return *MakeHull(points).hull; }

Pose RandomPose(Random& random, double spread) {
  return Pose(math::ExpSO3(Vector3d(random.Normal(), random.Normal(), random.Normal())),
              spread * Vector3d(random.Normal(), random.Normal(), random.Normal()));
}

TEST(HullTest, HoldsItsPointsAndIsClosed) {
  Random random(1);
  for (int i = 0; i < 60; ++i) {
    std::vector<Vector3d> points = Cloud(4 + random.Index(80), random);
    if (i % 4 == 1) points = BoxCorners({0.3, 0.1, 0.2});
    // Points on faces and edges, repeated ones, and noise as of single precision.
    for (int k = 0; k < 30 && i % 2 == 1; ++k) {
      const double t = random.Index(2) == 0 ? 0.5 : random.Uniform(0, 1);
      const int n = static_cast<int>(points.size());
      points.push_back((1 - t) * points[random.Index(n)] + t * points[random.Index(n)]);
    }
    const Pose X = RandomPose(random, 0.3);
    for (Vector3d& p : points) p = i % 3 == 0 ? (X * p).cast<float>().cast<double>() : X * p;
    const HullResult made = MakeHull(points);
    ASSERT_TRUE(made.hull);
    const Polytope& hull = *made.hull->polytope;
    EXPECT_EQ(hull.vertices.size() + hull.faces.size(), hull.edges.size() + 2);
    const double tolerance = 1e-5 * hull.radius;
    for (const Polytope::Face& face : hull.faces) {
      for (const Vector3d& p : points) EXPECT_LE(face.normal.dot(p), face.offset + tolerance);
      for (const int corner : face.corners) {
        EXPECT_NEAR(face.normal.dot(hull.vertices[corner]), face.offset, tolerance);
      }
    }
    for (const Polytope::Edge& edge : hull.edges) {
      const Vector3d across = hull.faces[edge.left].normal.cross(hull.faces[edge.right].normal);
      EXPECT_GT(across.dot(edge.along), -1e-6);
    }
    if (i % 4 == 1) {
      EXPECT_EQ(hull.faces.size(), 6u) << i;
    }
  }
}

TEST(HullTest, MassIsThatOfTheSameBox) {
  Random random(2);
  for (int i = 0; i < 20; ++i) {
    const Vector3d size(random.Uniform(0.01, 1), random.Uniform(0.01, 1), random.Uniform(0.01, 1));
    const Pose X = RandomPose(random, 0.5);
    std::vector<Vector3d> points = BoxCorners(size);
    for (Vector3d& p : points) p = X * p;
    const Hull hull = MustMake(points);
    EXPECT_NEAR(Volume(hull), size.prod(), 1e-12);
    EXPECT_LT((CentreOfMass(Primitive(hull)) - X.p).norm(), 1e-12);
    EXPECT_LT((UnitInertia(hull) - X.R * UnitInertia(Box{size}) * X.R.transpose()).norm(), 1e-12);
    const Part part = CentredPart(hull, Pose());
    EXPECT_LT((part.X_SP.p - X.p).norm(), 1e-12);
    EXPECT_LT((CentreOfMass(Shape(std::vector<Part>{part})) - X.p).norm(), 1e-12);
  }
}

TEST(HullTest, SaysWhyThereIsNone) {
  EXPECT_EQ(MakeHull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}).problem, "are fewer than four");
  EXPECT_EQ(MakeHull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}}).problem, "lie in one plane");
  EXPECT_EQ(MakeHull({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}).problem, "lie in one plane");
  EXPECT_EQ(MakeHull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, std::nan("")}}).problem, "are not all finite");
  EXPECT_EQ(MakeHull(std::vector<Vector3d>(9, {1, 2, 3})).problem, "are within a hundredth of a millimetre");
  EXPECT_EQ(MakeHull({{0, 0, 0}, {1e9, 0, 0}, {0, 1, 0}, {0, 0, 1}}).problem, "reach farther than 10 km");
}

TEST(HullTest, AsGoodAsFlatIsAMillionthOfTheExtent) {
  Random random(7);
  for (const double extent : {0.01, 1.0, 300.0}) {
    for (const bool tapered : {false, true}) {
      for (const double thickness : {0.3, 0.6, 0.95, 1.05, 2.0, 100.0}) {
        // A plate, or a tetrahedron, whose least width is so many millionths of its extent.
        std::vector<Vector3d> points =
            BoxCorners({0.6 * extent, 0.8 * extent, tapered ? 0 : 1e-6 * thickness * extent});
        if (tapered) {
          points = {{0, 0, 0}, {0.6 * extent, 0, 0}, {0, 0.8 * extent, 0}};
          points.emplace_back(0.1 * extent, 0.1 * extent, 1e-6 * thickness * extent);
        }
        const Pose X = RandomPose(random, 0.1 * extent);
        Vector3d lower = Vector3d::Constant(1e9), upper = -lower;
        for (Vector3d& p : points) {
          p = X.R * p;
          lower = lower.cwiseMin(p);
          upper = upper.cwiseMax(p);
        }
        // The extent is that of the bounding box, which depends on how the points are turned.
        const double share = thickness * extent / (upper - lower).norm();
        if (std::abs(share - 1) < 0.04) continue;
        const HullResult made = MakeHull(points);
        EXPECT_EQ(made.hull.has_value(), share > 1) << extent << " " << thickness << " " << made.problem;
        if (share < 1) {
          EXPECT_EQ(made.problem, "lie in one plane");
        }
      }
    }
  }
}

TEST(HullTest, KeepsToItsMostCorners) {
  Random random(3);
  std::vector<Vector3d> points = Cloud(2000, random);
  for (Vector3d& p : points) p.normalize();
  const HullResult made = MakeHull(points, 40);
  EXPECT_LE(made.hull->polytope->vertices.size(), 40u);
  EXPECT_GT(made.left_out, 1e-3);
  EXPECT_LT(made.left_out, 0.2);
}

TEST(HullTest, ABoxByItsCornersIsTheBox) {
  Random random(4);
  const std::vector<Primitive> others = {Box{{0.3, 0.12, 0.05}}, Sphere{0.07}, Capsule{0.02, 0.25},
                                         Cylinder{0.05, 0.12}, MustMake(BoxCorners({0.2, 0.05, 0.1}))};
  const Box box{{0.2, 0.15, 0.1}};
  const Hull hull = MustMake(BoxCorners(box.size));
  for (const Primitive& other : others) {
    for (int i = 0; i < 200; ++i) {
      const Pose X_WA = RandomPose(random, 0.1), X_WB = RandomPose(random, 0.1);
      const Distance as_box = SignedDistance(box, X_WA, other, X_WB);
      const Distance as_hull = SignedDistance(hull, X_WA, other, X_WB);
      const Distance swapped = SignedDistance(other, X_WB, hull, X_WA);
      EXPECT_NEAR(as_box.distance, as_hull.distance, 5e-6) << KindName(other);
      EXPECT_NEAR(swapped.distance, as_hull.distance, 1e-9) << KindName(other);
      EXPECT_LT((as_hull.p_WB - as_hull.p_WA - as_hull.distance * as_hull.n_W).norm(), 1e-9);
      const DistanceDerivative exact = DifferentiateDistance(as_hull, X_WA, X_WB);
      bool kink = false;
      for (int axis = 0; axis < 6; ++axis) {
        for (const double sign : {1.0, -1.0}) {
          const math::Vector6d step = sign * 2e-5 * math::Vector6d::Unit(axis);
          const Distance near = SignedDistance(hull, X_WA, other, X_WB * math::ExpSE3(step));
          if ((near.n_W - as_hull.n_W).norm() > 0.01 || (near.p_WB - as_hull.p_WB).norm() > 0.01) kink = true;
        }
      }
      if (kink) continue;
      const auto of_a = [&](const Pose& X) {
        return Eigen::VectorXd::Constant(1, SignedDistance(hull, X, other, X_WB).distance);
      };
      EXPECT_LT((exact.dA - math::NumericPoseJacobian(of_a, X_WA, 1e-5)).norm(), 1e-5) << KindName(other);
    }
  }
}

TEST(HullTest, RestsFlatOnATableInTheMiddleOfTheFace) {
  const Hull hull =
      MustMake({{-0.1, -0.05, 0}, {0.1, -0.05, 0}, {0.1, 0.05, 0}, {-0.1, 0.05, 0}, {0, 0, 0.1}});
  const Distance d =
      SignedDistance(Box{{2, 1, 0.1}}, Pose(Vector3d(0, 0, -0.05)), hull, Pose(Vector3d(0.2, 0.1, 0)));
  EXPECT_NEAR(d.distance, 0, 1e-15);
  EXPECT_LT((d.n_W - Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT((d.p_WA - Vector3d(0.2, 0.1, 0)).norm(), 1e-12);
  const FlatFacet foot = SupportPolygon(Shape(Primitive(hull)), {0, 0, -1});
  EXPECT_NEAR(Area(foot.polygon), 0.02, 1e-12);
}

TEST(HullTest, PointsRaysAndBoundsAgree) {
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    const Hull hull = MustMake(Cloud(5 + random.Index(30), random));
    const Pose X_WS = RandomPose(random, 0.5);
    const Vector3d q = RandomPose(random, 1.5).p;
    const PointDistance d = DistanceToPoint(Primitive(hull), X_WS, q);
    EXPECT_NEAR(std::max(0.0, d.distance),
                (SlowProject(hull, X_WS.Inverse() * q) - X_WS.Inverse() * q).norm(), 1e-9);
    EXPECT_LT(SlowSurfaceMiss(hull, X_WS.Inverse() * d.p_W), 1e-9);
    const auto hit = CastRay(Primitive(hull), X_WS, q, X_WS.p - q);
    if (hit) {
      EXPECT_NEAR(DistanceToPoint(Primitive(hull), X_WS, hit->p_W).distance, 0, 1e-9);
    }
    const Aabb box = BoundingBox(Primitive(hull), X_WS);
    for (const Vector3d& p : hull.polytope->vertices) {
      EXPECT_TRUE(((X_WS * p).array() <= box.upper.array() + 1e-12).all());
      EXPECT_LE(p.norm(), BoundingRadius(Primitive(hull)) + 1e-12);
    }
  }
}

TEST(HullTest, RestingFacesAreThoseOfTheHull) {
  const Shape box = Shape(Primitive(MustMake(BoxCorners({0.2, 0.3, 0.1}))));
  const std::vector<FlatFacet> faces = RestingFaces(box, Vector3d::Zero());
  ASSERT_EQ(faces.size(), 6u);
  EXPECT_NEAR(faces[0].margin, 0.1, 1e-12);
}

}  // namespace
}  // namespace tether::geometry
