#include "tether/execution/observer/contact_detector.h"

#include <algorithm>

#include <Eigen/Cholesky>

namespace tether::execution {

math::Vector6d HandWrench(const robot::State& state, const Eigen::VectorXd& tau_external) {
  const Eigen::MatrixXd& J = state.J_BH();
  math::Matrix6d JJt;
  JJt.noalias() = J * J.transpose();
  JJt.diagonal().array() += 1e-6;
  math::Vector6d rhs;
  rhs.noalias() = J * tau_external;
  return JJt.ldlt().solve(rhs);
}

void ContactDetector::Start() {
  time_ = 0;
  above_ = 0;
  resistance_ = 0;
  baseline_.setZero();
}

bool ContactDetector::Update(const Eigen::Vector3d& force, const Eigen::Vector3d& direction, double dt) {
  time_ += dt;
  if (time_ <= options_.settle) {
    baseline_ += (force - baseline_) * std::min(1.0, dt / time_);
    return false;
  }
  resistance_ = -(force - baseline_).dot(direction);
  above_ = resistance_ > options_.threshold ? above_ + dt : 0;
  return above_ >= options_.hold;
}

}  // namespace tether::execution
