#pragma once

#include <memory>

#include <Eigen/Core>

#include "tether/execution/reference/joint_search.h"
#include "tether/math/pose.h"
#include "tether/robot/model.h"

namespace tether::execution {

/// Whether an arm reaches a pose of its hand within its joint limits, whatever is in the way: damped
/// least-squares inverse kinematics from several starts, some of them drawn, one iteration per tick. Of poses
/// that are reached it says so within a start or two; "out of reach" is what all starts agree on.
/// Deterministic; Advance() allocates nothing.
class ReachSearch : public JointSearch {
 public:
  explicit ReachSearch(const std::shared_ptr<const robot::Model>& model);

  /// Starts over for a hand pose in the base frame. The first starts are `q`, `other` (n, or empty) and home.
  void Start(const math::Pose& X_BH, const Eigen::VectorXd& q, const Eigen::VectorXd& other);
  void Advance();
  const math::Pose& X_BH() const { return X_BH_; }

 private:
  robot::State kinematics_;
  math::Pose X_BH_;
  Eigen::VectorXd zero_, step_;
};

}  // namespace tether::execution
