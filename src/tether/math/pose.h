#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "tether/math/so3.h"

namespace tether::math {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// A rigid transform X_AB: the pose of frame B in frame A, in SE(3). p_AQ = X_AB * p_BQ, X_AC = X_AB * X_BC.
///
/// A pose is perturbed on the right, X ← X · Exp(δ), with δ = (translation, rotation) in B, metres and
/// radians (docs/architecture.md, "Conventions"). "Derivative in the pose" always means the derivative in
/// this δ, at δ = 0.
struct Pose {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();

  Pose() = default;
  Pose(const Eigen::Matrix3d& R_AB, const Eigen::Vector3d& p_AB) : R(R_AB), p(p_AB) {}
  explicit Pose(const Eigen::Vector3d& p_AB) : p(p_AB) {}
  /// The quaternion is normalised here; its norm must not be zero.
  Pose(const Eigen::Quaterniond& q_AB, const Eigen::Vector3d& p_AB)
      : R(q_AB.normalized().toRotationMatrix()), p(p_AB) {}

  Pose operator*(const Pose& X_BC) const { return {R * X_BC.R, R * X_BC.p + p}; }
  Eigen::Vector3d operator*(const Eigen::Vector3d& p_BQ) const { return R * p_BQ + p; }
  Pose Inverse() const { return {R.transpose(), -(R.transpose() * p)}; }
  /// The unit quaternion with w ≥ 0.
  Eigen::Quaterniond Quaternion() const;
};

/// X_AB⁻¹ · X_AC = X_BC.
inline Pose Between(const Pose& X_AB, const Pose& X_AC) {
  return {X_AB.R.transpose() * X_AC.R, X_AB.R.transpose() * (X_AC.p - X_AB.p)};
}

/// The exponential of SE(3): δ = (ρ, ω) ↦ (J_l(ω) ρ, Exp(ω)).
Pose ExpSE3(const Vector6d& delta);

/// The inverse of ExpSE3, for rotations below π.
Vector6d LogSE3(const Pose& X);

/// Ad_X with X · Exp(δ) · X⁻¹ = Exp(Ad_X δ), for δ = (translation, rotation).
Matrix6d Adjoint(const Pose& X);

/// Ad of X⁻¹, without inverting first. If X_WC = X_WB · X_BC and B is perturbed by δ_B, then C is by
/// AdjointInverse(X_BC) δ_B.
Matrix6d AdjointInverse(const Pose& X);

/// Rotation from roll, pitch, yaw about the fixed axes x, y, z: R = Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Matrix3d RotationFromRpy(const Eigen::Vector3d& rpy);

/// The geodesic angle between two rotations, in [0, π].
double AngleBetween(const Eigen::Matrix3d& R1, const Eigen::Matrix3d& R2);

}  // namespace tether::math
