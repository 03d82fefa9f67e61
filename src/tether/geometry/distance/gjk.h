#pragma once

#include "tether/geometry/distance/core.h"

/// The distance of two cores that are apart, whatever their kinds; not for use outside this room.
namespace tether::geometry::internal {

struct Apart {
  bool apart = false;
  Eigen::Vector3d p_A = Eigen::Vector3d::Zero();  ///< The nearest points, in A; if apart.
  Eigen::Vector3d p_B = Eigen::Vector3d::Zero();
};

/// Gilbert, Johnson and Keerthi's algorithm: walks to the point of the Minkowski difference that is nearest
/// to the origin. "Apart" is proved, by a separating normal. Accurate to about 1e-12 m between polytopes. For
/// cores that touch to within 1e-9 m either answer is possible.
Apart FindApart(const Query& query);

/// Whether the cores certainly overlap, by a few steps of the same algorithm; false also where more steps
/// would be needed.
bool SurelyOverlap(const Query& query);

}  // namespace tether::geometry::internal
