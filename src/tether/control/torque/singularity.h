#pragma once

#include <limits>

#include <Eigen/Core>

#include "tether/robot/kinematics.h"

namespace tether::control {

/// Where the hand's least mobility is below this, the arm is as good as singular, m (per radian at a lever of
/// 0.2 m).
inline constexpr double kSingular = 0.06;

/// How well the hand can move.
struct Dexterity {
  /// About the least singular value of J with rotations weighed by a length L: (trace (J Jᵀ)⁻¹)^(−½), m. Zero
  /// at a singularity.
  double least = 0;
  /// The derivative of log √det(J Jᵀ) in q.
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, robot::kMostJoints, 1> gradient;
};

/// `J_BH`: the hand's Jacobian, 6 × n, at the configuration of `kinematics`; `length`: what a radian counts,
/// m. The gradient is exact: with J_i the column of joint i, ∂J_i/∂q_k follows from the axes alone. Arms with
/// fewer than six joints are always singular; their gradient is zero, as it is where `least` is not `below`.
Dexterity FindDexterity(const robot::Kinematics& kinematics, const Eigen::MatrixXd& J_BH, double length,
                        double below = std::numeric_limits<double>::infinity());

}  // namespace tether::control
