#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace tether::geometry {

/// A convex polygon: vertices counter-clockwise, none repeated. One vertex is a point, two are a segment;
/// empty is the empty set.
using Polygon = std::vector<Eigen::Vector2d>;

/// The set of x with normal · x ≤ offset; the normal is a unit vector.
struct HalfPlane {
  Eigen::Vector2d normal;
  double offset;
};

/// The convex hull, starting from the lowest x (then y). Points within `tolerance` of one another or of a
/// straight edge are dropped.
Polygon ConvexHull(std::vector<Eigen::Vector2d> points, double tolerance = 1e-9);

/// m² for vertices in m; 0 for fewer than three vertices.
double Area(const Polygon& polygon);
/// The centroid of the area; of a segment or point, its middle. (0, 0) if empty.
Eigen::Vector2d Centroid(const Polygon& polygon);

/// One half plane per edge, whose intersection is the polygon; a constraint "p lies inside by m" is the
/// smooth rows normal · p ≤ offset − m (ERRATA A12c). Empty for fewer than three vertices.
std::vector<HalfPlane> EdgeHalfPlanes(const Polygon& polygon);

/// The signed distance from a point to the polygon's edge: how far inside it is, negative outside. For a
/// point, a segment or the empty set never positive.
double ContainmentMargin(const Polygon& polygon, const Eigen::Vector2d& point);

/// The points that are inside by at least `margin` ≥ 0; may be empty.
Polygon Shrink(const Polygon& polygon, double margin);

/// The intersection of the polygon and a half plane.
Polygon Cut(const Polygon& polygon, const HalfPlane& half_plane);
/// The same into a polygon whose storage is used again; not the one that is cut.
void CutInto(const Polygon& polygon, const HalfPlane& half_plane, Polygon* cut);

/// The polygon turned by `yaw` about the origin, then moved.
Polygon Transform(const Polygon& polygon, double yaw, const Eigen::Vector2d& translation);

/// A motion that puts polygon `inner` into `outer`: turned by yaw, then moved.
struct Fit {
  double yaw;
  Eigen::Vector2d translation;
};

/// Whether `inner`, turned by `yaw`, fits inside `outer` (to 1e-9 m) under some translation; if so, one in
/// the middle of those that do.
std::optional<Fit> FitsInside(const Polygon& inner, const Polygon& outer, double yaw);

/// Over all yaws: those that make an edge of one parallel to an edge of the other, then every half degree. A
/// fit that is found is one; a fit that exists only within half a degree between these yaws may be missed.
/// The first fit in that order, aligned yaws by increasing |yaw|.
std::optional<Fit> FitsInside(const Polygon& inner, const Polygon& outer);

}  // namespace tether::geometry
