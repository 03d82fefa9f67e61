#pragma once

#include <Eigen/Core>

#include "tether/math/pose.h"
#include "tether/robot/model.h"

namespace tether::execution {

/// The wrench (force N, moment Nm, at the hand's origin, base frame) on the hand that fits the external joint
/// torques (n, Nm) best: τ = Jᵀ F by least squares. Allocates nothing.
math::Vector6d HandWrench(const robot::State& state, const Eigen::VectorXd& tau_external);

/// Detects contact during a motion: the force on the hand against the motion grows past a threshold, relative
/// to what it was as the motion began (the payload's weight). Allocates nothing.
class ContactDetector {
 public:
  struct Options {
    double threshold = 2.5;  ///< N
    double settle = 0.08;    ///< Time to learn the force without contact, s.
    double hold = 0.006;     ///< The force must stay above the threshold for so long, s.
  };

  ContactDetector() = default;
  explicit ContactDetector(const Options& options) : options_(options) {}

  /// A motion begins: the force without contact is learned anew.
  void Start();
  /// One tick of `dt` s: the force on the hand and the direction of motion (unit, or zero when not moving),
  /// both in one frame. Returns whether contact is felt.
  bool Update(const Eigen::Vector3d& force, const Eigen::Vector3d& direction, double dt);
  /// The change of the force against the motion, N.
  double resistance() const { return resistance_; }

 private:
  Options options_;
  double time_ = 0;
  double above_ = 0;
  double resistance_ = 0;
  Eigen::Vector3d baseline_ = Eigen::Vector3d::Zero();
};

}  // namespace tether::execution
