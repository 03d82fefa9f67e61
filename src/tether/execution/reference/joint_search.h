#pragma once

#include <array>
#include <initializer_list>
#include <memory>

#include <Eigen/Core>

#include "tether/common/random.h"
#include "tether/robot/model.h"

namespace tether::execution {

/// What searches for joint positions within limits have alike: several starts, given ones first and then some
/// that are drawn, so many iterations from each, and how near the best of them came. Deterministic; allocates
/// nothing.
class JointSearch {
 public:
  enum class State { kIdle, kSearching, kReached, kOutOfReach };

  State state() const { return state_; }
  void Stop() { state_ = State::kIdle; }
  /// How near it comes, once it is out of reach: m and rad, of the best start.
  double nearest_m() const { return nearest_m_; }
  double nearest_rad() const { return nearest_rad_; }

  /// Iterations that it takes at most.
  static constexpr int kStarts = 24, kIterations = 40;

 protected:
  static constexpr double kMaxStep = 0.4;  ///< rad
  static constexpr double kLever = 0.2;    ///< What a radian counts, m.

  explicit JointSearch(const std::shared_ptr<const robot::Model>& model);

  /// Starts over, from these positions (n, rad) first: kMostFirst at most.
  void Begin(std::initializer_list<const Eigen::VectorXd*> first);
  /// Takes how far q_ is off. True if it is to take a step; else it has been reached, or the search goes on
  /// from another start or has ended.
  bool TakesStep(double off_m, double off_rad);

  std::shared_ptr<const robot::Model> model_;
  Eigen::VectorXd q_;
  State state_ = State::kIdle;

 private:
  void NextStart();

  static constexpr int kMostFirst = 3;
  std::array<Eigen::VectorXd, kMostFirst> first_;
  Random random_{1};
  int num_first_ = 0, start_ = 0, iteration_ = 0;
  double least_ = 0, nearest_m_ = 0, nearest_rad_ = 0;
};

}  // namespace tether::execution
