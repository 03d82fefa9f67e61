#pragma once

#include <vector>

#include "tether/geometry/polygon/polygon.h"
#include "tether/geometry/shape.h"

namespace tether::geometry {

/// The support function h(d) = max over the solid of d · x, in its own frame; d of any length.
double Support(const Primitive& primitive, const Eigen::Vector3d& d);
double Support(const Shape& shape, const Eigen::Vector3d& d);

/// A point of the solid where d · x is greatest.
Eigen::Vector3d SupportPoint(const Primitive& primitive, const Eigen::Vector3d& d);
Eigen::Vector3d SupportPoint(const Shape& shape, const Eigen::Vector3d& d);

/// The part of a shape's convex hull that lies on a supporting plane, all in the shape's frame S.
///
/// A point of the plane is offset · normal + x · axis_x + y · axis_y, with (axis_x, axis_y, normal)
/// right-handed, so that the polygon runs counter-clockwise when seen from outside. axis_x is the projection
/// of S's x axis on the plane, or of its y axis where |normal · x| > 0.9.
struct FlatFacet {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< Outward, unit.
  double offset = 0;                                  ///< h(normal), m.
  Eigen::Vector3d axis_x = Eigen::Vector3d::UnitX();
  Eigen::Vector3d axis_y = Eigen::Vector3d::UnitY();
  Polygon polygon;                      ///< In (axis_x, axis_y), m.
  std::vector<Eigen::Vector3d> points;  ///< The same vertices in S.
  double margin = 0;  ///< Stability of a resting face: how far inside the centre of mass stands over it, m.

  Eigen::Vector2d Project(const Eigen::Vector3d& p_S) const { return {axis_x.dot(p_S), axis_y.dot(p_S)}; }
  Eigen::Vector3d Lift(const Eigen::Vector2d& p) const {
    return offset * normal + p.x() * axis_x + p.y() * axis_y;
  }
};

/// The flat extreme set of the shape's convex hull in a direction (not zero), to within kInputLength: a
/// rectangle for a box's face, a point for a sphere, a segment for a lying capsule or cylinder, the regular
/// 32-gon inscribed in the disc for an upright cylinder; for a compound the hull of what its parts have
/// there. `margin` stays 0.
FlatFacet SupportPolygon(const Shape& shape, const Eigen::Vector3d& direction);

/// The faces of the shape's convex hull on which it rests stably: those whose polygon contains the projection
/// of the centre of mass (in S) with a margin above kInputLength. Faces that differ by no more than that are
/// one. Spheres and capsules have none; a cylinder has its caps, its side rolls. Ordered by margin, greatest
/// first, then by normal, greatest z, y, x first. Of a compound in time as corners squared, times that of
/// balls and rims: meant to be computed once per shape.
std::vector<FlatFacet> RestingFaces(const Shape& shape, const Eigen::Vector3d& centre_of_mass);

}  // namespace tether::geometry
