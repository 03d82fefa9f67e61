#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "tether/geometry/polygon/support.h"
#include "tether/geometry/shape.h"

namespace tether::constraints {

/// An edge of a flat face, in the solid's frame: its outward normal in the plane, with normal · x = offset
/// along it.
struct FaceEdge {
  Eigen::Vector3d normal;
  double offset;
};

/// The edges of a face; none if it is not flat.
std::vector<FaceEdge> EdgesOf(const geometry::FlatFacet& face);

/// A flat side of a convex part, in the frame of the shape that the part belongs to.
struct FlatSide {
  Eigen::Vector3d normal;                ///< Outward, unit.
  double offset;                         ///< normal · x ≤ offset for all of the part, m.
  std::vector<Eigen::Vector3d> corners;  ///< Counter-clockwise seen from outside.
  std::string name;                      ///< "+x" for a box, the side's number for a hull.
};

/// The flat sides of a box or a hull; none for what is round.
std::vector<FlatSide> FlatSides(const geometry::Part& part);

/// The least and the greatest of direction · x over the corners of a side, m.
struct Extent {
  double low, high;
};
/// `direction`: in the frame of the shape.
Extent ExtentAlong(const FlatSide& side, const Eigen::Vector3d& direction);

/// The middle of a face, on it, in the solid's frame.
Eigen::Vector3d CentroidOf(const geometry::FlatFacet& face);

/// Radius of the circle about the middle that fits on the face, m.
double InradiusOf(const geometry::FlatFacet& face);

/// The support function of one part, in the frame of the shape that it belongs to.
double PartSupport(const geometry::Part& part, const Eigen::Vector3d& direction);

}  // namespace tether::constraints
