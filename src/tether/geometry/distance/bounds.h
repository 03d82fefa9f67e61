#pragma once

#include "tether/geometry/shape.h"

namespace tether::geometry {

/// The radius of the smallest ball about the shape's frame origin that contains the shape, m.
double BoundingRadius(const Primitive& primitive);
/// As above; for a compound an upper bound of it.
double BoundingRadius(const Shape& shape);

/// A box whose sides are along the axes of the frame it is given in.
struct Aabb {
  Eigen::Vector3d lower = Eigen::Vector3d::Constant(1e300);
  Eigen::Vector3d upper = Eigen::Vector3d::Constant(-1e300);

  /// Grows the box so that it contains the other.
  void Include(const Aabb& other) {
    lower = lower.cwiseMin(other.lower);
    upper = upper.cwiseMax(other.upper);
  }
  /// The distance to another box; 0 if they overlap.
  double DistanceTo(const Aabb& other) const {
    return (lower - other.upper).cwiseMax(other.lower - upper).cwiseMax(0.0).norm();
  }
};

/// The smallest such box in the world.
Aabb BoundingBox(const Primitive& primitive, const math::Pose& X_WP);
Aabb BoundingBox(const Shape& shape, const math::Pose& X_WS);

/// A cheap lower bound of SignedDistance, for leaving out pairs that are far apart: the better of the bounds
/// from bounding balls and boxes; −1e300 if these overlap.
double DistanceLowerBound(const Shape& a, const math::Pose& X_WA, const Shape& b, const math::Pose& X_WB);

}  // namespace tether::geometry
