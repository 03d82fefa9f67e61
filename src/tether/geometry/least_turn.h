#pragma once

#include <Eigen/Core>

#include "tether/geometry/shape.h"

namespace tether::geometry {

/// The rotation vector (rad, in W) of the least turn that takes a body from orientation R_WA to one that
/// looks like R_WB: a body of revolution about an axis through its frame's origin may be turned about that
/// axis, a sphere at its origin about any. For others it is log(R_WB R_WAᵀ).
Eigen::Vector3d LeastTurn(const Shape& shape, const Eigen::Matrix3d& R_WA, const Eigen::Matrix3d& R_WB);

}  // namespace tether::geometry
