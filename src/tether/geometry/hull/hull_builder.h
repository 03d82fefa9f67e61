#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

/// The convex hull of points as triangles; not for use outside this room.
namespace tether::geometry::internal {

/// Corners of a triangle, counter-clockwise seen from outside.
using HullTriangle = std::array<int, 3>;

struct TriangulatedHull {
  std::vector<HullTriangle> triangles;  ///< Indices of the points; empty if they lie in one plane.
  double left_out = 0;                  ///< The greatest distance of a point from the hull, outside of it, m.
};

/// Adds the farthest point outside until none is farther outside than `tolerance` or the hull has
/// `max_vertices`. The points must be finite.
TriangulatedHull TriangulateHull(const std::vector<Eigen::Vector3d>& points, double tolerance,
                                 int max_vertices);

}  // namespace tether::geometry::internal
