#include "tether/control/torque/torque_limiter.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tether::control {
namespace {

// Bounds that no torques reach are set this far within what they reach, as a share.
constexpr double kWithin = 0.999;
// Too high a speed is taken back with up to so many times the acceleration that a joint is to have.
constexpr double kHarder = 4;
// What is beyond a bound by less is on it, rad/s².
constexpr double kRounding = 1e-6;

}  // namespace

TorqueLimiter::TorqueLimiter(std::shared_ptr<const robot::Model> model, const LimiterOptions& options)
    : model_(std::move(model)),
      options_(options),
      reserve_(*model_),
      problem_(model_->dof(), 0, model_->dof()),
      solver_(model_->dof(), 0, model_->dof()),
      M_llt_(model_->dof()) {
  for (Eigen::VectorXd* vector :
       {&last_, &out_, &hold_, &lower_, &upper_, &a_, &a_lower_, &a_upper_, &most_, &pushed_}) {
    vector->setZero(model_->dof());
  }
  Minv_.setIdentity(model_->dof(), model_->dof());
}

const Eigen::VectorXd& TorqueLimiter::Limit(const robot::State& state, const Eigen::VectorXd& torque,
                                            const Eigen::VectorXd* carried, const Eigen::VectorXd* external) {
  flags_ = {};
  const int n = model_->dof();
  const bool known = state.q().allFinite() && state.v().allFinite() && state.M().allFinite() &&
                     state.bias().allFinite() && (carried == nullptr || carried->allFinite());
  if (known) {
    hold_ = state.bias();
    if (carried != nullptr) hold_ += *carried;
  }
  if (!started_) {
    last_.setZero();
    if (known) last_ = hold_.cwiseMax(-model_->max_torque()).cwiseMin(model_->max_torque());
    started_ = true;
  }
  for (int i = 0; i < n; ++i) {
    const double change = options_.period * model_->max_torque_rate()[i], most = model_->max_torque()[i];
    lower_[i] = std::max(-most, last_[i] - change);
    upper_[i] = std::min(most, last_[i] + change);
    double in = i < torque.size() ? torque[i] : std::nan("");
    if (!std::isfinite(in)) {
      flags_.not_finite = true;
      // Towards holding the arm, or as it was.
      in = known ? hold_[i] : last_[i];
    }
    flags_.torque = flags_.torque || std::abs(in) > most;
    flags_.rate = flags_.rate || std::abs(in - last_[i]) > change * (1 + 1e-9);
    out_[i] = std::clamp(in, lower_[i], upper_[i]);
  }
  if (known) LimitMotion(state, external);
  last_ = out_;
  return out_;
}

void TorqueLimiter::LimitMotion(const robot::State& state, const Eigen::VectorXd* external) {
  const int n = model_->dof();
  M_llt_.compute(state.M());
  if (M_llt_.info() != Eigen::Success) return;
  a_ = out_ - hold_;
  M_llt_.solveInPlace(a_);
  pushed_.setZero();
  if (external != nullptr && external->size() == n && external->allFinite()) {
    pushed_ = *external;
    M_llt_.solveInPlace(pushed_);
  }
  reserve_.Set(state.M(), hold_, options_.torque_share, options_.rate_share);
  bool within = true;
  for (int i = 0; i < n; ++i) {
    const double q = state.q()[i], v = state.v()[i];
    const double hardest = model_->max_acceleration()[i];
    const double fastest = options_.velocity_share * model_->max_velocity()[i];
    const Braking braking = reserve_.of(i);
    const auto most = [&](double room, double speed, double pushed) {
      pushed = std::max(0.0, pushed);
      const double to_keep = std::min(
          hardest,
          MostAccelerationToKeepSpeed(fastest - speed, kHarder * hardest, options_.period, braking) - pushed);
      const double to_stop = MostAccelerationToStop(room - options_.limit_gap, speed, hardest, hardest,
                                                    options_.return_speed, options_.period, braking);
      return std::min(to_keep, to_stop < hardest ? to_stop - pushed : to_stop);
    };
    a_upper_[i] = most(model_->upper()[i] - q, v, pushed_[i]);
    a_lower_[i] = -most(q - model_->lower()[i], -v, -pushed_[i]);
    // To hold against a push is no acceleration: the other bound has so much more room.
    a_upper_[i] += std::max(0.0, -pushed_[i]);
    a_lower_[i] -= std::max(0.0, pushed_[i]);
    // What a limit needs may be harder than a motion is wanted to be.
    if (a_lower_[i] > a_upper_[i]) {
      const double middle = 0.5 * (a_lower_[i] + a_upper_[i]);
      const bool up = a_lower_[i] >= hardest, down = a_upper_[i] <= -hardest;
      a_lower_[i] = a_upper_[i] = up == down ? middle : up ? a_lower_[i] : a_upper_[i];
    }
    within = within && a_[i] <= a_upper_[i] + kRounding && a_[i] >= a_lower_[i] - kRounding;
  }
  if (within) return;
  flags_.motion = true;
  // In torques, so that the box is one of bounds: min ‖M⁻¹ (τ − τ_in)‖² with rows M⁻¹ (τ − h).
  Minv_.setIdentity();
  M_llt_.solveInPlace(Minv_);
  problem_.Resize(n, 0, n);
  problem_.H().noalias() = Minv_.transpose() * Minv_;
  problem_.g().noalias() = -(Minv_.transpose() * (Minv_ * out_));
  problem_.x_lower() = lower_;
  problem_.x_upper() = upper_;
  problem_.A() = Minv_;
  most_.noalias() = Minv_ * hold_;
  for (int i = 0; i < n; ++i) {
    double reach_lower = 0, reach_upper = 0;
    for (int j = 0; j < n; ++j) {
      reach_lower += std::min(Minv_(i, j) * lower_[j], Minv_(i, j) * upper_[j]);
      reach_upper += std::max(Minv_(i, j) * lower_[j], Minv_(i, j) * upper_[j]);
    }
    const double middle = 0.5 * (reach_lower + reach_upper), half = kWithin * (reach_upper - middle);
    problem_.lower()[i] = std::min(a_lower_[i] + most_[i], middle + half);
    problem_.upper()[i] = std::max(a_upper_[i] + most_[i], middle - half);
    flags_.unavoidable =
        flags_.unavoidable || a_lower_[i] + most_[i] > reach_upper || a_upper_[i] + most_[i] < reach_lower;
  }
  if (solver_.Solve(problem_, qp::Start::kCold) == qp::Status::kSolved && solver_.x().allFinite()) {
    out_ = solver_.x().cwiseMax(lower_).cwiseMin(upper_);
    return;
  }
  // Bounds of several joints conflict: each joint's torque does what it can for its own.
  flags_.unavoidable = true;
  for (int i = 0; i < n; ++i) {
    if (a_[i] > a_upper_[i]) out_[i] = lower_[i];
    if (a_[i] < a_lower_[i]) out_[i] = upper_[i];
  }
}

}  // namespace tether::control
