#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Core>

namespace tether::control {

/// Counts how often a joint goes to and fro: its velocity changes its sign within 100 ms, being above 0.01
/// rad/s before and after.
class SignChanges {
 public:
  explicit SignChanges(Eigen::Index joints) : last_(static_cast<size_t>(joints)) {}

  void Observe(double time, const Eigen::VectorXd& v) {
    for (size_t i = 0; i < last_.size(); ++i) {
      const double speed = v[static_cast<Eigen::Index>(i)];
      if (std::abs(speed) <= kSlow) continue;
      const double sign = speed > 0 ? 1 : -1;
      if (sign == -last_[i].sign && time - last_[i].time < kSoon) ++count_;
      last_[i] = {sign, time};
    }
  }
  int count() const { return count_; }

 private:
  static constexpr double kSlow = 0.01;  // rad/s
  static constexpr double kSoon = 0.1;   // s
  struct Last {
    double sign = 0, time = 0;
  };
  std::vector<Last> last_;
  int count_ = 0;
};

}  // namespace tether::control
