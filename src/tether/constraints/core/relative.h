#pragma once

#include <Eigen/Core>

#include "tether/math/pose.h"
#include "tether/nlp/program.h"

/// Shared by the pose functions; not for users of the room.
namespace tether::constraints::internal {

/// The relative pose X_BA = X_B⁻¹ X_A and how it answers to perturbations: δ_A moves it as X_BA Exp(δ_A), δ_B
/// as Exp(−δ_B) X_BA.
struct Relative {
  math::Pose X_BA;
  explicit Relative(const math::Pose& X_B, const math::Pose& X_A) : X_BA(math::Between(X_B, X_A)) {}

  /// d(n_B · p_BQ): columns for B at `b`, for A at `a`.
  void PointRow(const Eigen::Vector3d& n_B, const Eigen::Vector3d& p_AQ, int row, int b, int a,
                nlp::JacobianRef& J) const {
    const Eigen::Vector3d p_BQ = X_BA * p_AQ;
    const Eigen::RowVector3d n_A = n_B.transpose() * X_BA.R;
    J.block<1, 3>(row, a) = n_A;
    J.block<1, 3>(row, a + 3) = p_AQ.cross(n_A.transpose()).transpose();
    J.block<1, 3>(row, b) = -n_B.transpose();
    J.block<1, 3>(row, b + 3) = -p_BQ.cross(n_B).transpose();
  }
};

}  // namespace tether::constraints::internal
