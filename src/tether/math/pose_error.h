#pragma once

#include "tether/math/pose.h"

namespace tether::math {

/// What leads from a pose X_AB to another, X_AC, in the frame A that both are in: (p_AC − p_AB, m; the
/// rotation vector of R_AC · R_ABᵀ, rad, at most π long). The velocity that gets there in a second, if it is
/// kept.
inline Vector6d PoseError(const Pose& X_AB, const Pose& X_AC) {
  Vector6d error;
  error.head<3>() = X_AC.p - X_AB.p;
  error.tail<3>() = LogSO3(X_AC.R * X_AB.R.transpose());
  return error;
}

}  // namespace tether::math
