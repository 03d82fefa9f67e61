#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "tether/common/random.h"
#include "tether/constraints/core/pose_function.h"
#include "tether/math/pose.h"
#include "tether/robot/kinematics.h"
#include "tether/robot/model.h"

namespace tether::execution {

/// As ReachSearch, of functions of a frame on the hand in place of a pose: whether joint positions within
/// their limits bring them to zero, whatever is in the way. Damped Gauss–Newton steps from several starts,
/// some of them drawn, one iteration at a time. Deterministic; Advance() allocates nothing.
class GoalSearch {
 public:
  enum class State { kIdle, kSearching, kReached, kOutOfReach };

  explicit GoalSearch(const std::shared_ptr<const robot::Model>& model);

  /// Starts over: functions of (target, frame), the target in the base frame, the frame in the hand's; from
  /// `q` (n, rad) first.
  void Start(std::vector<constraints::PoseFunctionPtr> functions, const math::Pose& X_BTarget,
             const math::Pose& X_HF, const Eigen::VectorXd& q);
  void Advance();
  void Stop() { state_ = State::kIdle; }
  State state() const { return state_; }
  const math::Pose& X_BTarget() const { return X_BT_; }
  /// How near the functions come to zero, once it is out of reach: m and rad, of the best start.
  double nearest_m() const { return nearest_m_; }
  double nearest_rad() const { return nearest_rad_; }

  static constexpr int kStarts = 24, kIterations = 40;

 private:
  void NextStart();
  /// Residuals and their derivatives in q of all functions, weighed; how far they are from zero, m and rad.
  int Evaluate(double* off_m, double* off_rad);

  std::shared_ptr<const robot::Model> model_;
  robot::Kinematics kinematics_;
  std::vector<constraints::PoseFunctionPtr> functions_;
  math::Pose X_BT_, X_HF_;
  static constexpr int kMostRows = 16;
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMostRows, kMostRows>;
  Eigen::VectorXd q_, given_, step_, r_, rows_r_;
  Eigen::MatrixXd J_, J_BH_, rows_J_;
  Square JJt_;
  Random random_{1};
  State state_ = State::kIdle;
  int start_ = 0, iteration_ = 0;
  double least_ = 0, nearest_m_ = 0, nearest_rad_ = 0;
};

}  // namespace tether::execution
