#pragma once

#include <vector>

#include "tether/geometry/shape.h"

namespace tether::motion::internal {

/// A ball; those of a cover contain the whole solid together.
struct CoverSphere {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  ///< In the solid's frame, m.
  double outer = 0;                             ///< m
  double inner = 0;  ///< A ball of this radius about p lies within the solid; 0: none is known. m.
};

/// Balls that cover a primitive, as tightly as a few dozen can.
std::vector<CoverSphere> CoverWithSpheres(const geometry::Primitive& primitive);

}  // namespace tether::motion::internal
