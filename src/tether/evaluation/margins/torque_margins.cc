#include "tether/evaluation/margins/torque_margins.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tether::evaluation {
namespace {

enum MarginIndex : size_t { kTorque, kRate };

}  // namespace

TorqueMargins::TorqueMargins(std::shared_ptr<const robot::Model> model, double max_force, double period,
                             bool torques)
    : model_(std::move(model)), max_force_(max_force), period_(period), torques_(torques), forces_(period) {
  if (torques) {
    margins_.push_back({"joint torque limits", 1e300, "Nm", "torques", 0, "", 1e300});
    margins_.push_back({"joint torque rate limits", 1e300, "Nm/s", "torque rates", 0, "", 1e300});
  }
  force_ = margins_.size();
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
  for (int i = 0; torques_ && i < model_->dof(); ++i) {
    const std::string& joint = model_->joint_names()[static_cast<size_t>(i)];
    Take(kTorque, model_->max_torque()[i] - std::abs(torque[i]), time, joint);
    if (last_.size() != torque.size()) continue;
    Take(kRate, model_->max_torque_rate()[i] - std::abs(torque[i] - last_[i]) / period_, time, joint);
  }
  last_ = torque;
  int which = -1;
  const double most = forces_.Observe(time, unintended, &which);
  if (which < 0) return Take(force_, max_force_ - most, time, "");
  const PairForce& pair = unintended[static_cast<size_t>(which)];
  Take(force_, max_force_ - most, time, pair.a + " and " + pair.b);
}

void TorqueMargins::ForgetLast() {
  for (Margin& margin : margins_) margin.last = 1e300;
}

}  // namespace tether::evaluation
