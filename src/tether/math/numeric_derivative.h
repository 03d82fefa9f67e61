#pragma once

#include <functional>

#include <Eigen/Core>

#include "tether/math/pose.h"

namespace tether::math {

/// Numeric differentiation, for tests and for checking constraints that users add. The product itself never
/// differentiates numerically. Central differences with one Richardson extrapolation: the error is O(step⁴).

/// The Jacobian of f at x, (size of f) × (size of x).
Eigen::MatrixXd NumericJacobian(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f,
                                const Eigen::VectorXd& x, double step = 1e-4);

/// The Jacobian of f in a right perturbation of the pose X, (size of f) × 6, columns (translation, rotation).
Eigen::MatrixXd NumericPoseJacobian(const std::function<Eigen::VectorXd(const Pose&)>& f, const Pose& X,
                                    double step = 1e-4);

}  // namespace tether::math
