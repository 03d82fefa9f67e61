#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "tether/constraints/core/pose_function.h"
#include "tether/execution/reference/joint_search.h"
#include "tether/math/pose.h"
#include "tether/robot/kinematics.h"
#include "tether/robot/model.h"

namespace tether::execution {

/// As ReachSearch, of functions of a frame on the hand in place of a pose: whether joint positions within
/// their limits bring them to zero, whatever is in the way. Damped Gauss–Newton steps from several starts,
/// some of them drawn, one iteration at a time. Deterministic; Advance() allocates nothing.
class GoalSearch : public JointSearch {
 public:
  explicit GoalSearch(const std::shared_ptr<const robot::Model>& model);

  /// Starts over: functions of (target, frame), the target in the base frame, the frame in the hand's; from
  /// `q` (n, rad) first.
  void Start(std::vector<constraints::PoseFunctionPtr> functions, const math::Pose& X_BTarget,
             const math::Pose& X_HF, const Eigen::VectorXd& q);
  void Advance();
  const math::Pose& X_BTarget() const { return X_BT_; }

 private:
  /// Residuals and their derivatives in q of all functions, weighed; how far they are from zero, m and rad.
  int Evaluate(double* off_m, double* off_rad);

  robot::Kinematics kinematics_;
  std::vector<constraints::PoseFunctionPtr> functions_;
  math::Pose X_BT_, X_HF_;
  static constexpr int kMostRows = 16;
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMostRows, kMostRows>;
  Eigen::VectorXd step_, r_, rows_r_;
  Eigen::MatrixXd J_, J_BH_, rows_J_;
  Square JJt_;
};

}  // namespace tether::execution
