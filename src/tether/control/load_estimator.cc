#include "tether/control/load_estimator.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "tether/robot/gravity.h"

namespace tether::control {
namespace {

/// One measurement y = aᵀx + noise of variance r, of a Kalman filter.
template <int N>
void Measure(const Eigen::Matrix<double, N, 1>& a, double y, double r, Eigen::Matrix<double, N, 1>& x,
             Eigen::Matrix<double, N, N>& P) {
  const Eigen::Matrix<double, N, 1> Pa = P * a;
  const double s = a.dot(Pa) + r;
  x += Pa * ((y - a.dot(x)) / s);
  P -= Pa * Pa.transpose() / s;
}

}  // namespace

LoadEstimator::LoadEstimator(int dof, const Eigen::Vector3d& gravity_B, const LoadEstimatorOptions& options)
    : options_(options), gravity_B_(gravity_B), sensor_error_(Eigen::VectorXd::Zero(dof)) {
  assert(dof <= static_cast<int>(joints_.size()));
  Reset();
}

void LoadEstimator::Reset() {
  for (Joint& joint : joints_) {
    joint.x.setZero();
    joint.P = Eigen::Vector2d(options_.bias * options_.bias, options_.mass_error * options_.mass_error)
                  .asDiagonal();
  }
  sensor_error_.setZero();
  age_ = 0;
  Carry(false);
}

void LoadEstimator::Carry(bool carries) {
  carries_ = carries;
  payload_.setZero();
  const double moment = options_.mass * options_.lever;
  payload_P_ =
      Eigen::Vector4d(options_.mass * options_.mass, moment * moment, moment * moment, moment * moment)
          .asDiagonal();
}

void LoadEstimator::LearnSensors(const Eigen::VectorXd& held, const Eigen::VectorXd& external) {
  const double r = options_.torque_noise * options_.torque_noise;
  const Eigen::Vector2d drift(options_.bias_drift * options_.bias_drift * options_.period,
                              options_.mass_drift * options_.mass_drift * options_.period);
  for (Eigen::Index i = 0; i < held.size(); ++i) {
    Joint& joint = joints_[i];
    joint.P.diagonal() += drift;
    Measure<2>({1, held[i]}, external[i], r, joint.x, joint.P);
  }
}

void LoadEstimator::LearnPayload(const robot::State& state, const Eigen::VectorXd& external) {
  const double r = options_.torque_noise * options_.torque_noise;
  const double drift = options_.payload_drift * options_.payload_drift * options_.period;
  const double moment_drift = drift * options_.lever * options_.lever;
  payload_P_.diagonal() += Eigen::Vector4d(drift, moment_drift, moment_drift, moment_drift);
  Eigen::Matrix3d gravity_cross;
  gravity_cross << 0, -gravity_B_.z(), gravity_B_.y(), gravity_B_.z(), 0, -gravity_B_.x(), -gravity_B_.y(),
      gravity_B_.x(), 0;
  const Eigen::Matrix3d by_moment = -gravity_cross * state.X_BH().R;
  const Eigen::MatrixXd& J = state.J_BH();
  for (Eigen::Index i = 0; i < external.size(); ++i) {
    Eigen::Vector4d a;
    a[0] = J.col(i).head<3>().dot(gravity_B_);
    a.tail<3>() = by_moment.transpose() * J.col(i).tail<3>();
    Measure<4>(a, external[i] - sensor_error_[i], r, payload_, payload_P_);
  }
}

void LoadEstimator::Update(const robot::State& state, const Eigen::VectorXd& external, bool touches) {
  if (!external.allFinite()) return;
  age_ += options_.period;
  if (!carries_ && !touches) LearnSensors(state.bias(), external);
  for (Eigen::Index i = 0; i < external.size(); ++i) {
    const Joint& joint = joints_[i];
    sensor_error_[i] = joint.x[0] + joint.x[1] * state.bias()[i];
  }
  if (carries_ && !touches) LearnPayload(state, external);
}

math::Vector6d LoadEstimator::Holding(const math::Pose& X_BH) const {
  math::Vector6d F = math::Vector6d::Zero();
  if (!carries_) return F;
  F.head<3>() = -std::max(0.0, payload_[0]) * gravity_B_;
  F.tail<3>() = -(X_BH.R * payload_.tail<3>()).cross(gravity_B_);
  return F;
}

double LoadEstimator::weight_error() const {
  return carries_ ? 2 * robot::kGravity * std::sqrt(payload_P_(0, 0)) : 0;
}

}  // namespace tether::control
