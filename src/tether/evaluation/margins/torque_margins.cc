#include "tether/evaluation/margins/torque_margins.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tether::evaluation {
namespace {

constexpr double kWindow = 0.01;  // s
// More than this is counted, N.
constexpr double kPressing = 50;

enum MarginIndex : size_t { kTorque, kRate, kForce };

}  // namespace

TorqueMargins::TorqueMargins(std::shared_ptr<const robot::Model> model, double max_force, double period)
    : model_(std::move(model)),
      max_force_(max_force),
      period_(period),
      window_ticks_(std::max<size_t>(1, static_cast<size_t>(std::lround(kWindow / period)))) {
  margins_.push_back({"joint torque limits", 1e300, "Nm", "torques", 0, "", 1e300});
  margins_.push_back({"joint torque rate limits", 1e300, "Nm/s", "torque rates", 0, "", 1e300});
  margins_.push_back({"unintended force", max_force, "N", "forces", 0, "", max_force});
}

void TorqueMargins::Take(size_t margin, double value, double time, const std::string& what) {
  Margin& taken = margins_[margin];
  taken.last = std::min(taken.last, value);
  if (value >= taken.minimum) return;
  taken.minimum = value;
  taken.time = time;
  taken.what = what;
}

void TorqueMargins::Observe(double time, const Eigen::VectorXd& torque,
                            const std::vector<PairForce>& unintended) {
  for (Margin& margin : margins_) margin.last = 1e300;
  margins_[kForce].last = max_force_;
  for (int i = 0; i < model_->dof(); ++i) {
    const std::string& joint = model_->joint_names()[static_cast<size_t>(i)];
    Take(kTorque, model_->max_torque()[i] - std::abs(torque[i]), time, joint);
    if (last_.size() != torque.size()) continue;
    Take(kRate, model_->max_torque_rate()[i] - std::abs(torque[i] - last_[i]) / period_, time, joint);
  }
  last_ = torque;
  for (const PairForce& pair : unintended) {
    if (pair.force <= 0) continue;
    const auto known = std::find_if(windows_.begin(), windows_.end(),
                                    [&](const Window& w) { return w.a == pair.a && w.b == pair.b; });
    if (known == windows_.end()) {
      windows_.push_back({pair.a, pair.b, std::vector<double>(window_ticks_, 0.0)});
    }
  }
  double most = 0;
  for (Window& window : windows_) {
    double force = 0;
    for (const PairForce& pair : unintended) {
      if (pair.a == window.a && pair.b == window.b) force = pair.force;
    }
    window.sum += force - window.forces[window.next];
    window.forces[window.next] = force;
    window.next = (window.next + 1) % window.forces.size();
    const double mean = window.sum / static_cast<double>(window.forces.size());
    most = std::max(most, mean);
    Take(kForce, max_force_ - mean, time, window.a + " and " + window.b);
  }
  most_force_ = std::max(most_force_, most);
  if (most > kPressing) pressed_s_ += period_;
}

}  // namespace tether::evaluation
