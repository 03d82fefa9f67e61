#include "tether/execution/monitor/observation_guard.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tether/common/text.h"

namespace tether::execution {
namespace {

// A stamp further ahead than this, s, or than so many periods, has jumped.
constexpr double kClockSlack = 0.02, kClockPeriods = 10;
// Positions are measured to this, rad; followed by velocities they are off by so much more per second, up to
// this.
constexpr double kSlack = 1e-3, kDrift = 0.01, kMostDrift = 0.02;
// No joint is so many times faster than its limit.
constexpr double kMostSpeed = 2;

bool IsFinite(const robot::Observation& seen, Eigen::Index n) {
  return seen.q.size() == n && seen.v.size() == n && seen.q.allFinite() && seen.v.allFinite() &&
         std::isfinite(seen.gripper_opening) && std::isfinite(seen.time);
}

}  // namespace

ObservationGuard::ObservationGuard(std::shared_ptr<const robot::Model> model,
                                   const Eigen::Vector3d& gravity_B, double period)
    : model_(std::move(model)),
      period_(period),
      state_(model_, gravity_B),
      clock_(std::max(kClockSlack, kClockPeriods * period)),
      a_(Eigen::VectorXd::Zero(model_->dof())),
      M_llt_(model_->dof()) {}

void ObservationGuard::Predict(const robot::Command& told, const Eigen::VectorXd* carried) {
  const Eigen::Index n = model_->dof();
  Eigen::VectorXd &q = believed_.q, &v = believed_.v;
  if (told.mode == robot::Command::Mode::kVelocity) {
    if (told.velocity.size() == n && told.velocity.allFinite()) v = told.velocity;
  } else if (told.torque.size() == n && told.torque.allFinite()) {
    state_.Set(q, v);
    a_ = told.torque - state_.bias();
    if (carried != nullptr && carried->size() == n && carried->allFinite()) a_ -= *carried;
    M_llt_.compute(state_.M());
    M_llt_.solveInPlace(a_);
    if (a_.allFinite()) v += period_ * a_;
  }
  v = v.cwiseMin(model_->max_velocity()).cwiseMax(-model_->max_velocity());
  q = (q + period_ * v).cwiseMin(model_->upper()).cwiseMax(model_->lower());
}

// Joint by joint: what is plausible is believed.
ObservationGuard::Trouble ObservationGuard::Believe(const robot::Observation& seen) {
  const double drift = std::min(kMostDrift, kDrift * jumped_);
  bool jump = false;
  for (Eigen::Index i = 0; i < seen.q.size(); ++i) {
    const double fastest = model_->max_velocity()[i];
    double &q = believed_.q[i], &v = believed_.v[i];
    const bool v_sure = std::abs(seen.v[i]) < kMostSpeed * fastest &&
                        (blind_ > 0 || std::abs(seen.v[i] - v) < kMostSpeed * fastest);
    const double off = seen.q[i] - (q + period_ * v);
    const bool q_sure = std::abs(off) < fastest * (period_ + blind_) + kSlack + drift;
    if (v_sure) v = seen.v[i];
    q = q_sure ? seen.q[i] : q + period_ * v;
    if (q_sure && v_sure) continue;
    if (!jump) {
      joint_ = static_cast<int>(i);
      off_ = off;
    }
    jump = true;
  }
  believed_.gripper_opening = seen.gripper_opening;
  blind_ = 0;
  jumped_ = jump ? jumped_ + period_ : 0;
  if (seen.tau_external.allFinite()) {
    believed_.tau_external = seen.tau_external;
  } else if (!jump) {
    return Trouble::kNotFinite;
  }
  return jump ? Trouble::kJump : Trouble::kFine;
}

void ObservationGuard::Take(const robot::Observation& seen, const robot::Command& told,
                            const Eigen::VectorXd* carried) {
  const bool finite = IsFinite(seen, model_->dof());
  if (!started_) {
    believed_ = seen;
    trouble_ = finite ? Trouble::kFine : Trouble::kNotFinite;
    if (finite) clock_.Take(seen.time, period_);
    started_ = finite;
    if (!finite) last_ = trouble_;
    return;
  }
  const bool jumped = clock_.Take(finite ? seen.time : std::nan(""), period_);
  const double next = believed_.time + period_;
  if (finite && clock_.news()) {
    trouble_ = Believe(seen);
    if (jumped && trouble_ == Trouble::kFine) trouble_ = Trouble::kClock;
    believed_.time = std::max(believed_.time, clock_.time());
  } else {
    trouble_ = finite ? Trouble::kSilence : Trouble::kNotFinite;
    Predict(told, carried);
    blind_ += period_;
    believed_.time = next;
  }
  if (trouble_ != Trouble::kFine) last_ = trouble_;
}

std::string ObservationGuard::Describe(const std::string& robot) const {
  switch (last_) {
    case Trouble::kFine:
      return "";
    case Trouble::kSilence:
      return "no measurement of '" + robot + "' comes";
    case Trouble::kNotFinite:
      return "what is measured of '" + robot + "' is not finite";
    case Trouble::kClock:
      return "the clock of '" + robot + "' has jumped by " + Fixed(clock_.jump(), 3) + " s";
    case Trouble::kJump:
      return model_->joint_names()[static_cast<size_t>(joint_)] + " of '" + robot +
             "' seems to have jumped by " + Fixed(off_, 3) + " rad";
  }
  return "";
}

}  // namespace tether::execution
