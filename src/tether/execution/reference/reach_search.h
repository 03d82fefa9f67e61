#pragma once

#include <memory>

#include <Eigen/Core>

#include "tether/common/random.h"
#include "tether/math/pose.h"
#include "tether/robot/model.h"

namespace tether::execution {

/// Whether an arm reaches a pose of its hand within its joint limits, whatever is in the way: damped
/// least-squares inverse kinematics from several starts, some of them drawn, one iteration per tick. Of poses
/// that are reached it says so within a start or two; "out of reach" is what all starts agree on.
/// Deterministic; Advance() allocates nothing.
class ReachSearch {
 public:
  enum class State { kIdle, kSearching, kReached, kOutOfReach };

  explicit ReachSearch(const std::shared_ptr<const robot::Model>& model);

  /// Starts over for a hand pose in the base frame. The first starts are `q`, `other` (n, or empty) and home.
  void Start(const math::Pose& X_BH, const Eigen::VectorXd& q, const Eigen::VectorXd& other);
  void Advance();
  void Stop() { state_ = State::kIdle; }
  State state() const { return state_; }
  const math::Pose& X_BH() const { return X_BH_; }
  /// How near to the pose the hand comes, once it is out of reach: m and rad, of the best start.
  double nearest_m() const { return nearest_m_; }
  double nearest_rad() const { return nearest_rad_; }

  /// Iterations that it takes at most.
  static constexpr int kStarts = 24, kIterations = 40;

 private:
  void NextStart();

  std::shared_ptr<const robot::Model> model_;
  robot::State kinematics_;
  math::Pose X_BH_;
  Eigen::VectorXd q_, given_, other_, zero_, step_;
  Random random_{1};
  State state_ = State::kIdle;
  int start_ = 0, iteration_ = 0;
  double least_ = 0, nearest_m_ = 0, nearest_rad_ = 0;
};

}  // namespace tether::execution
