#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Core>

#include "tether/geometry/shape.h"

/// The distance kernels behind SignedDistance; not for use outside this room.
namespace tether::geometry::internal {

/// Directions within this angle count as parallel, rad.
inline constexpr double kParallel = 1e-8;
/// Signed distances this near to one another count as tied, m.
inline constexpr double kTie = 1e-10;

/// A primitive without its rounding: a box with half sides `half` (some may be 0: a point, a segment along z)
/// plus a disc of radius `disc` across z. The primitive is the core with a ball of radius `rounding` added,
/// so that its signed distances are those of the core less `rounding`, inside and outside. A hull is its own
/// core; its `half` is zero and its `disc` is −1, so that the other kinds are not slowed down.
struct Core {
  enum class Kind { kPoint, kSegment, kBox, kCylinder, kHull };
  Kind kind = Kind::kPoint;
  Eigen::Vector3d half = Eigen::Vector3d::Zero();
  double disc = 0;
  double rounding = 0;
  const Polytope* hull = nullptr;

  /// max over the core of d · x.
  double Support(const Eigen::Vector3d& d) const {
    return std::abs(d.x()) * half.x() + std::abs(d.y()) * half.y() + std::abs(d.z()) * half.z() +
           (disc != 0 ? SupportAcross(d) : 0.0);
  }
  /// Support(−d), without the sign where it makes no difference.
  double SupportAgainst(const Eigen::Vector3d& d) const {
    return std::abs(d.x()) * half.x() + std::abs(d.y()) * half.y() + std::abs(d.z()) * half.z() +
           (disc != 0 ? SupportAcross(-d) : 0.0);
  }
  /// A point of the core where d · x is greatest.
  Eigen::Vector3d SupportPoint(const Eigen::Vector3d& d) const;

 private:
  double SupportAcross(const Eigen::Vector3d& d) const {
    return disc > 0 ? disc * std::sqrt(d.x() * d.x() + d.y() * d.y()) : SupportOfHull(d);
  }
  double SupportOfHull(const Eigen::Vector3d& d) const;
};

Core MakeCore(const Primitive& primitive);

/// The result of a kernel, in the frame of core A.
struct Gap {
  double distance = 0;
  Eigen::Vector3d p_A = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_B = Eigen::Vector3d::Zero();
  Eigen::Vector3d n = Eigen::Vector3d::UnitZ();
};

/// A kernel's input: two cores, the pose of B in A, and the world's up direction in A (for ties).
struct Query {
  Core a;
  Core b;
  math::Pose X_AB;
  Eigen::Vector3d up_A = Eigen::Vector3d::UnitZ();

  /// The extent of B along n less that of A: a lower bound of the signed distance for every unit n, equal to
  /// it for the best n.
  double Separation(const Eigen::Vector3d& n) const {
    return n.dot(X_AB.p) - a.Support(n) - b.SupportAgainst(X_AB.R.transpose() * n);
  }
};

/// A flat set of extreme points of a core: a point, a segment, a rectangle, a 16-gon that stands for a disc
/// or a hull's face, in order around it. Faces with more corners are thinned out to kMaxPoints.
struct Feature {
  static constexpr int kDiscPoints = 16;
  static constexpr int kMaxPoints = 48;
  /// Columns of a matrix, which unlike an array of vectors is not constructed one by one.
  struct Points {
    Eigen::Matrix<double, 3, kMaxPoints> columns;
    auto operator[](int i) { return columns.col(i); }
    auto operator[](int i) const { return columns.col(i); }
  };
  Points points;
  int size = 0;
};

/// The points of the core that are extreme along n, to within the angle kParallel. `X` places the core.
Feature ExtremeFeature(const Core& core, const math::Pose& X, const Eigen::Vector3d& n);

/// The centre of the overlap of the two cores' extreme features along n (of A) and −n (of B), projected along
/// n. The witness points and n go to `gap`. Returns how far the features are from overlapping (0 if they do),
/// m.
double WitnessPointsAlong(const Query& query, const Eigen::Vector3d& n, Gap* gap);

/// The best of a series of candidate normals, with the order of ties that Distance documents.
class BestNormal {
 public:
  explicit BestNormal(const Query& query) : query_(query) {}
  /// `rank` is 0 for a face's normal, greater for others. Does nothing if n is not finite.
  void Try(const Eigen::Vector3d& n, int rank);
  /// Both n and −n. Cores are symmetric, so the one that points from A's centre to B's does better.
  void TryBoth(const Eigen::Vector3d& n, int rank) {
    const double along = n.dot(query_.X_AB.p);
    if (along >= 0 || -along <= kTie) Try(n, rank);
    if (along < kTie) Try(-n, rank);
  }
  const Eigen::Vector3d& n() const { return n_; }
  double separation() const { return separation_; }

 private:
  const Query& query_;
  Eigen::Vector3d n_ = Eigen::Vector3d::UnitZ();
  double separation_ = -1e300;
  double up_ = 0;
  int rank_ = 0;
};

/// A unit vector across d (any length, zero allowed), as near to `up` as possible.
Eigen::Vector3d UpAcross(const Eigen::Vector3d& d, const Eigen::Vector3d& up);

/// Kernels. A's kind comes before or equals B's in the order of Core::Kind.
Gap PointPoint(const Query& query);
Gap PointSegment(const Query& query);
Gap SegmentSegment(const Query& query);
Gap PointBox(const Query& query);
Gap SegmentBox(const Query& query);
Gap BoxBox(const Query& query);
Gap PointCylinder(const Query& query);
Gap SegmentCylinder(const Query& query);
Gap BoxCylinder(const Query& query);
Gap CylinderCylinder(const Query& query);
Gap PointHull(const Query& query);
Gap SegmentHull(const Query& query);
Gap BoxHull(const Query& query);
Gap CylinderHull(const Query& query);
Gap HullHull(const Query& query);

/// p_B − p_A of the support points along n: the gradient of the separation in n. The separation is the least
/// of g · n over all differences g of points, so that any of them bounds it from above.
inline Eigen::Vector3d SupportDifference(const Query& query, const Eigen::Vector3d& n) {
  return query.X_AB * query.b.SupportPoint(-(query.X_AB.R.transpose() * n)) - query.a.SupportPoint(n);
}

/// The signed distance from a point to a box, cylinder or hull at the origin: nearest surface point and
/// outward normal.
struct Foot {
  double distance = 0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Vector3d n = Eigen::Vector3d::UnitZ();
};
/// The foot of q, in the solid's frame; `up`, the world's up direction there, decides between equally near
/// faces inside.
Foot FootOnBox(const Eigen::Vector3d& half, const Eigen::Vector3d& q, const Eigen::Vector3d& up);
Foot FootOnHull(const Polytope& hull, const Eigen::Vector3d& q, const Eigen::Vector3d& up);
Foot FootOnCylinder(double radius, double half_length, const Eigen::Vector3d& q, const Eigen::Vector3d& up);

/// The point of a cylinder at the origin that is nearest to q: q itself where it is inside.
inline Eigen::Vector3d NearestOfCylinder(double radius, double half_length, const Eigen::Vector3d& q) {
  const double across = std::sqrt(q.x() * q.x() + q.y() * q.y());
  const double scale = across > radius ? radius / across : 1.0;
  return {scale * q.x(), scale * q.y(), std::clamp(q.z(), -half_length, half_length)};
}

/// The parameter in [0, 1] of the point of the segment p + t d that is nearest to a solid, the middle of them
/// where they are many. The segment must not meet the solid.
double NearestParameterToBox(const Eigen::Vector3d& half, const Eigen::Vector3d& p, Eigen::Vector3d d);
double NearestParameterToCylinder(double radius, double half_length, const Eigen::Vector3d& p,
                                  Eigen::Vector3d d);

}  // namespace tether::geometry::internal
