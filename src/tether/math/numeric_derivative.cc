#include "tether/math/numeric_derivative.h"

namespace tether::math {

Eigen::MatrixXd NumericJacobian(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f,
                                const Eigen::VectorXd& x, double step) {
  const auto central = [&](Eigen::Index column, double h) -> Eigen::VectorXd {
    Eigen::VectorXd forward = x, backward = x;
    forward[column] += h;
    backward[column] -= h;
    return (f(forward) - f(backward)) / (2 * h);
  };
  Eigen::MatrixXd J(f(x).size(), x.size());
  for (Eigen::Index column = 0; column < x.size(); ++column) {
    J.col(column) = (4 * central(column, step / 2) - central(column, step)) / 3;
  }
  return J;
}

Eigen::MatrixXd NumericPoseJacobian(const std::function<Eigen::VectorXd(const Pose&)>& f, const Pose& X,
                                    double step) {
  return NumericJacobian([&](const Eigen::VectorXd& delta) { return f(X * ExpSE3(Vector6d(delta))); },
                         Eigen::VectorXd::Zero(6), step);
}

}  // namespace tether::math
