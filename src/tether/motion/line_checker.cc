#include "tether/motion/line_checker.h"

#include <algorithm>
#include <cmath>

#include "tether/common/limits.h"

namespace tether::motion {

using Eigen::VectorXd;

bool SampledChecker::IsFree(const VectorXd& q) {
  PollLimits();
  ++checks_;
  return is_free_(q);
}

bool SampledChecker::IsFree(const VectorXd& a, const VectorXd& b) {
  const int steps = std::max(1, static_cast<int>(std::ceil((b - a).cwiseAbs().maxCoeff() / resolution_)));
  // The far end first: it is the likeliest not to be free.
  for (int i = steps; i > 0; --i) {
    if (!IsFree(a + (b - a) * (static_cast<double>(i) / steps))) return false;
  }
  return true;
}

std::string SampledChecker::Why(const VectorXd& /*q*/) const { return "something is too near"; }

}  // namespace tether::motion
