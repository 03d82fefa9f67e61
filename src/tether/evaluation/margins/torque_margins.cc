#include "tether/evaluation/margins/torque_margins.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tether/math/infinity.h"

namespace tether::evaluation {
namespace {

enum MarginIndex : size_t { kTorque, kRate };

}  // namespace

TorqueMargins::TorqueMargins(std::shared_ptr<const robot::Model> model, double max_force, double period,
                             bool torques)
    : model_(std::move(model)), max_force_(max_force), period_(period), torques_(torques), forces_(period) {
  if (torques) {
    margins_.push_back({"joint torque limits", math::kInfinity, "Nm", "torques", 0, "", math::kInfinity});
    margins_.push_back(
        {"joint torque rate limits", math::kInfinity, "Nm/s", "torque rates", 0, "", math::kInfinity});
  }
  force_ = margins_.size();
  margins_.push_back({"unintended force", max_force, "N", "forces", 0, "", max_force});
}

void TorqueMargins::Observe(double time, const Eigen::VectorXd& torque,
                            const std::vector<PairForce>& unintended) {
  for (int i = 0; torques_ && i < model_->dof(); ++i) {
    const std::string& joint = model_->joint_names()[i];
    margins_[kTorque].Take(model_->max_torque()[i] - std::abs(torque[i]), time, joint);
    if (last_.size() != torque.size()) continue;
    const double room = model_->max_torque_rate()[i] - std::abs(torque[i] - last_[i]) / period_;
    // The difference of two torques is only known to their rounding.
    const double rounding = 4 * std::numeric_limits<double>::epsilon() * std::abs(torque[i]) / period_;
    margins_[kRate].Take(std::abs(room) <= rounding ? 0 : room, time, joint);
  }
  last_ = torque;
  int which = -1;
  const double most = forces_.Observe(time, unintended, &which);
  if (which < 0) return margins_[force_].Take(max_force_ - most, time, "");
  const PairForce& pair = unintended[which];
  margins_[force_].Take(max_force_ - most, time, pair.a + " and " + pair.b);
}

void TorqueMargins::ForgetLast() {
  for (Margin& margin : margins_) margin.last = math::kInfinity;
}

}  // namespace tether::evaluation
