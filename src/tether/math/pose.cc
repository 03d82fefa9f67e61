#include "tether/math/pose.h"

namespace tether::math {

Eigen::Quaterniond Pose::Quaternion() const {
  Eigen::Quaterniond q(R);
  q.normalize();
  if (q.w() < 0) q.coeffs() *= -1;
  return q;
}

Pose ExpSE3(const Vector6d& delta) {
  const Eigen::Vector3d rho = delta.head<3>(), w = delta.tail<3>();
  return {ExpSO3(w), LeftJacobianSO3(w) * rho};
}

Vector6d LogSE3(const Pose& X) {
  const Eigen::Vector3d w = LogSO3(X.R);
  Vector6d delta;
  // J_l⁻¹(w) = J_r⁻¹(−w).
  delta << RightJacobianInverseSO3(-w) * X.p, w;
  return delta;
}

Matrix6d Adjoint(const Pose& X) {
  Matrix6d Ad;
  Ad << X.R, Hat(X.p) * X.R, Eigen::Matrix3d::Zero(), X.R;
  return Ad;
}

Matrix6d AdjointInverse(const Pose& X) {
  Matrix6d Ad;
  Ad << X.R.transpose(), -X.R.transpose() * Hat(X.p), Eigen::Matrix3d::Zero(), X.R.transpose();
  return Ad;
}

Eigen::Matrix3d RotationFromRpy(const Eigen::Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

double AngleBetween(const Eigen::Matrix3d& R1, const Eigen::Matrix3d& R2) {
  return LogSO3(R1.transpose() * R2).norm();
}

}  // namespace tether::math
