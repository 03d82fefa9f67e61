#include "tether/control/torque/singularity.h"

#include <cmath>

#include <Eigen/Cholesky>

#include "tether/math/pose.h"

namespace tether::control {

Dexterity FindDexterity(const robot::Kinematics& kinematics, const Eigen::MatrixXd& J_BH, double length,
                        double below) {
  using Eigen::Vector3d;
  const int n = kinematics.dof();
  Dexterity dexterity;
  dexterity.gradient.setZero(n);
  if (n < 6) return dexterity;
  math::Vector6d scale;
  scale << 1, 1, 1, length, length, length;
  Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, robot::kMostJoints> J = scale.asDiagonal() * J_BH;
  math::Matrix6d JJt = J * J.transpose();
  JJt.diagonal().array() += 1e-12;
  const Eigen::LLT<math::Matrix6d> factor(JJt);
  const math::Matrix6d inverse = factor.solve(math::Matrix6d::Identity());
  dexterity.least = 1 / std::sqrt(inverse.trace());
  if (dexterity.least >= below) return dexterity;
  // d log √det = trace(J⁺ dJ) with J⁺ = Jᵀ (J Jᵀ)⁻¹.
  const Eigen::Matrix<double, Eigen::Dynamic, 6, 0, robot::kMostJoints, 6> inverse_J =
      J.transpose() * inverse;
  const Vector3d p = kinematics.X_BH().p;
  for (int k = 0; k < n; ++k) {
    const Vector3d z_k = kinematics.X_BL(k + 1).R.col(2);
    const Vector3d arm_k = z_k.cross(p - kinematics.X_BL(k + 1).p);
    double sum = 0;
    for (int i = 0; i < n; ++i) {
      const Vector3d z_i = kinematics.X_BL(i + 1).R.col(2);
      // A joint before turns the axis and the arm; one after moves the hand only.
      const Vector3d linear =
          k <= i ? Vector3d(z_k.cross(z_i.cross(p - kinematics.X_BL(i + 1).p))) : Vector3d(z_i.cross(arm_k));
      sum += inverse_J.row(i).head<3>().dot(linear);
      if (k < i) sum += length * inverse_J.row(i).tail<3>().dot(z_k.cross(z_i));
    }
    dexterity.gradient[k] = sum;
  }
  return dexterity;
}

}  // namespace tether::control
