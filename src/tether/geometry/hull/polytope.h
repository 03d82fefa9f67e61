#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tether/geometry/shape.h"

namespace tether::geometry {

/// A convex polytope in the frame of the points it was made of: the shared, immutable data behind a Hull.
/// Faces are flat and as large as they can be: neighbouring triangles in one plane are one face.
struct Polytope {
  struct Face {
    Eigen::Vector3d normal;    ///< Outward, unit.
    double offset = 0;         ///< normal · x ≤ offset for all of the polytope, m.
    std::vector<int> corners;  ///< Indices of vertices, counter-clockwise seen from outside.
  };
  /// An edge from vertex to vertex, the left and the right face seen from outside; `along` is its unit
  /// direction, which is that of left normal × right normal.
  struct Edge {
    int from = 0, to = 0, left = 0, right = 0;
    Eigen::Vector3d along = Eigen::Vector3d::UnitX();
    double turn = 0;  ///< The angle between the two normals, rad.
  };

  std::vector<Eigen::Vector3d> vertices;  ///< m
  std::vector<Face> faces;
  std::vector<Edge> edges;
  double volume = 0;                                            ///< m³
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();           ///< m
  Eigen::Matrix3d second_moment = Eigen::Matrix3d::Identity();  ///< Mean of r r^T about the centroid, m².
  double radius = 0;                                            ///< max |vertex|, m.
};

/// The most corners of a hull, for fast distance queries.
inline constexpr int kMaxHullVertices = 128;
/// Points this near to the hull of the others, relative to their extent, are no corners; faces that are flat
/// to within it are one face. Coarse enough for files with single precision.
inline constexpr double kHullTolerance = 2e-7;

/// The result of MakeHull().
struct HullResult {
  std::optional<Hull> hull;  ///< None if the points have no hull with a volume.
  /// Why there is none, as a phrase that can follow "the points": "lie in one plane".
  std::string problem;
  /// How far the farthest point is outside of the hull, m. More than rounding only where the points would
  /// have more than `max_vertices` corners; these are chosen so that what is left out is least.
  double left_out = 0;
};

/// The convex hull of points, in their frame. Refuses fewer than four, non-finite ones, points all within a
/// plane (to 1e-6 of their extent), and extents below 1e-5 m or above 1e4 m. Takes time in proportion to
/// points times corners.
HullResult MakeHull(const std::vector<Eigen::Vector3d>& points, int max_vertices = kMaxHullVertices);

/// A hull as a part whose frame has its origin in the hull's centre of mass: what other rooms expect of a
/// primitive. X_SP is where the hull's own frame is.
Part CentredPart(const Hull& hull, const math::Pose& X_SP);

/// The inertia about the centre of mass of a body of uniform density, along the axes of the primitive's
/// frame: kg m² for a mass of 1 kg. Exact for every primitive.
Eigen::Matrix3d UnitInertia(const Primitive& primitive);

}  // namespace tether::geometry
