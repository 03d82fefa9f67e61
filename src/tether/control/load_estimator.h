#pragma once

#include <array>

#include <Eigen/Core>

#include "tether/math/pose.h"
#include "tether/robot/model.h"

namespace tether::control {

struct LoadEstimatorOptions {
  double period = 0.001;      ///< Between updates, s.
  double torque_noise = 0.5;  ///< Of each joint's external torque in each tick, Nm.
  double bias = 1;            ///< As large a constant error is expected in a joint's torque, Nm …
  double mass_error = 0.15;   ///< … and such a share of the joint's own weight.
  double bias_drift = 0.01;   ///< By which these wander, Nm/√s …
  double mass_drift = 0.005;  ///< … and 1/√s.
  double mass = 1;            ///< As heavy a payload is expected, kg …
  double lever = 0.1;         ///< … with its centre so far from the grasp point, m.
  double payload_drift =
      0.1;               ///< By which its mass wanders, kg/√s: fingers slide, a load is taken up slowly.
  double settle = 0.05;  ///< At the start, before which it says nothing, s.
};

/// Tells what external joint torques have besides contacts. Of a joint i without a payload,
///
///   τ_ext,i = b_i + ε_i h_i(q, q̇),
///
/// a constant and a share of the torque that holds the arm, since the masses of the model are known to some
/// per cent; of what the hand carries, mass m and first moment m c about the grasp point (hand frame): τ_ext
/// = J_vᵀ g m − J_wᵀ [g]ₓ R m c. Both are followed by Kalman filters with random walks, each measured by one
/// joint after the other. Nothing is learned from torques that may be due to a contact: that is for the
/// caller to say. Allocates nothing.
class LoadEstimator {
 public:
  LoadEstimator(int dof, const Eigen::Vector3d& gravity_B, const LoadEstimatorOptions& options);

  void Reset();
  /// The hand begins to carry something, or does not any more.
  void Carry(bool carries);
  bool carries() const { return carries_; }
  /// One tick. `state` must be set; `external`: n, Nm; `touches`: something may press on the arm or on what
  /// it holds.
  void Update(const robot::State& state, const Eigen::VectorXd& external, bool touches);

  /// What the sensors are off by at the last update, n, Nm.
  const Eigen::VectorXd& sensor_error() const { return sensor_error_; }
  /// It has seen enough for torques to be told from its errors.
  bool settled() const { return age_ >= options_.settle; }
  /// The force and moment (N, Nm, at the hand's origin, base frame) that hold the payload at this pose.
  math::Vector6d Holding(const math::Pose& X_BH) const;
  double mass() const { return payload_[0]; }  ///< kg
  /// What it may weigh more or less, N (two standard deviations); 0 without a payload.
  double weight_error() const;

 private:
  void LearnSensors(const Eigen::VectorXd& held, const Eigen::VectorXd& external);
  void LearnPayload(const robot::State& state, const Eigen::VectorXd& external);

  LoadEstimatorOptions options_;
  Eigen::Vector3d gravity_B_;
  struct Joint {
    Eigen::Vector2d x;  ///< b and ε.
    Eigen::Matrix2d P;
  };
  std::array<Joint, 16> joints_;
  Eigen::Vector4d payload_;  ///< m, and m c in the hand's frame.
  Eigen::Matrix4d payload_P_;
  Eigen::VectorXd sensor_error_;
  bool carries_ = false;
  double age_ = 0;  ///< s
};

}  // namespace tether::control
