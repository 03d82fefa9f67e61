#pragma once

#include <vector>

#include <Eigen/Core>

#include "tether/geometry/shape.h"
#include "tether/geometry/support.h"

namespace tether::constraints {

/// An edge of a flat face, in the solid's frame: its outward normal in the plane, with normal · x = offset
/// along it.
struct FaceEdge {
  Eigen::Vector3d normal;
  double offset;
};

/// The edges of a face; none if it is not flat.
std::vector<FaceEdge> EdgesOf(const geometry::FlatFacet& face);

/// The middle of a face, on it, in the solid's frame.
Eigen::Vector3d CentroidOf(const geometry::FlatFacet& face);

/// Radius of the circle about the middle that fits on the face, m.
double InradiusOf(const geometry::FlatFacet& face);

/// The support function of one part, in the frame of the shape that it belongs to.
double PartSupport(const geometry::Part& part, const Eigen::Vector3d& direction);

}  // namespace tether::constraints
