#include "tether/math/so3.h"

#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/SVD>

namespace tether::math {
namespace {

// Below this angle the closed forms lose digits to cancellation and the series are exact to double precision.
constexpr double kSmallAngle = 1e-2;

struct Coefficients {
  double a;  // sin θ / θ
  double b;  // (1 − cos θ) / θ²
  double c;  // (θ − sin θ) / θ³
};

Coefficients At(double theta) {
  const double t2 = theta * theta;
  if (theta < kSmallAngle) {
    return {1 - t2 / 6 * (1 - t2 / 20 * (1 - t2 / 42)), 0.5 - t2 / 24 * (1 - t2 / 30 * (1 - t2 / 56)),
            1.0 / 6 - t2 / 120 * (1 - t2 / 42 * (1 - t2 / 72))};
  }
  return {std::sin(theta) / theta, (1 - std::cos(theta)) / t2, (theta - std::sin(theta)) / (t2 * theta)};
}

}  // namespace

Eigen::Matrix3d Hat(const Eigen::Vector3d& w) {
  Eigen::Matrix3d W;
  W << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return W;
}

Eigen::Matrix3d ExpSO3(const Eigen::Vector3d& w) {
  const Coefficients k = At(w.norm());
  const Eigen::Matrix3d W = Hat(w);
  return Eigen::Matrix3d::Identity() + k.a * W + k.b * W * W;
}

Eigen::Vector3d LogSO3(const Eigen::Matrix3d& R) {
  // Through the quaternion: well conditioned over the whole range, π included.
  Eigen::Quaterniond q(R);
  q.normalize();
  if (q.w() < 0) q.coeffs() *= -1;
  const double s = q.vec().norm();
  if (s < 1e-8) return 2 * q.vec() / q.w();
  return 2 * std::atan2(s, q.w()) / s * q.vec();
}

Eigen::Matrix3d LeftJacobianSO3(const Eigen::Vector3d& w) {
  const Coefficients k = At(w.norm());
  const Eigen::Matrix3d W = Hat(w);
  return Eigen::Matrix3d::Identity() + k.b * W + k.c * W * W;
}

Eigen::Matrix3d RightJacobianSO3(const Eigen::Vector3d& w) { return LeftJacobianSO3(-w); }

Eigen::Matrix3d RightJacobianInverseSO3(const Eigen::Vector3d& w) {
  const double theta = w.norm();
  const double t2 = theta * theta;
  const double d = theta < kSmallAngle ? 1.0 / 12 + t2 / 720 * (1 + t2 / 42)
                                       : (1 - 0.5 * theta / std::tan(0.5 * theta)) / t2;
  const Eigen::Matrix3d W = Hat(w);
  return Eigen::Matrix3d::Identity() + 0.5 * W + d * W * W;
}

Eigen::Matrix3d ProjectToSO3(const Eigen::Matrix3d& M) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace tether::math
