#pragma once

#include <Eigen/Core>

namespace tether::math {

/// The cross-product matrix: Hat(w) v = w × v.
Eigen::Matrix3d Hat(const Eigen::Vector3d& w);

/// Rotation by ‖w‖ radians about w.
Eigen::Matrix3d ExpSO3(const Eigen::Vector3d& w);

/// The rotation vector of R, with ‖w‖ ≤ π. Regular everywhere below π; at π one of the two branches.
Eigen::Vector3d LogSO3(const Eigen::Matrix3d& R);

/// J_l with Exp(w + dw) = Exp(J_l dw) Exp(w) to first order. Paper A, eq. (22), with the coefficient
/// (θ − sin θ)/θ³ in place of the misprint, and the Taylor series near θ = 0.
Eigen::Matrix3d LeftJacobianSO3(const Eigen::Vector3d& w);

/// J_r with Exp(w + dw) = Exp(w) Exp(J_r dw) to first order; J_r(w) = J_l(−w).
Eigen::Matrix3d RightJacobianSO3(const Eigen::Vector3d& w);

/// The inverse of RightJacobianSO3, regular below 2π: Log(R Exp(dw)) = Log(R) + J_r⁻¹(Log R) dw to first
/// order.
Eigen::Matrix3d RightJacobianInverseSO3(const Eigen::Vector3d& w);

/// The rotation nearest to M in the Frobenius norm.
Eigen::Matrix3d ProjectToSO3(const Eigen::Matrix3d& M);

}  // namespace tether::math
