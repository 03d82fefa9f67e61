#include "tether/control/torque/joint_braking.h"

#include <algorithm>
#include <cmath>

namespace tether::control {
namespace {

// A joint whose load leaves no torque still counts on this share of its acceleration: the bound must be one.
constexpr double kLeastShare = 0.05;
constexpr int kBisections = 14;
// Excess speed goes at this rate, 1/s; so does the return from beyond a limit.
constexpr double kReturnRate = 30;

}  // namespace

double StoppingDistance(double v, double a, const Braking& braking) {
  const double D = braking.deceleration, J = braking.jerk;
  a = std::max(a, -D);
  if (v <= 0 && a <= 0) return 0;
  const double ramp = (a + D) / J;
  const double slow = v + a * ramp - 0.5 * J * ramp * ramp;
  if (slow > 0) {
    return v * ramp + 0.5 * a * ramp * ramp - J * ramp * ramp * ramp / 6 + slow * slow / (2 * D);
  }
  const double inside = a * a + 2 * J * v;
  if (inside <= 0) return 0;
  const double t = (a + std::sqrt(inside)) / J;
  return std::max(0.0, v * t + 0.5 * a * t * t - J * t * t * t / 6);
}

double MostAccelerationToStop(double room, double v, double most, double hardest, double return_speed,
                              double period, const Braking& braking) {
  if (room < 0) {
    const double speed = -std::min(return_speed, 10 * -room);
    return std::clamp(kReturnRate * (speed - v), -hardest, std::min(most, hardest));
  }
  const auto fits = [&](double a) {
    const double next_v = v + a * period;
    const double run = v * period + 0.5 * a * period * period;
    return run + StoppingDistance(next_v, a, braking) <= room;
  };
  if (fits(most)) return most;
  double low = -braking.deceleration, high = most;
  // Too late for what is counted on: all that there is.
  if (low >= high || !fits(low)) return -hardest;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    (fits(middle) ? low : high) = middle;
  }
  return low;
}

double MostAccelerationToKeepSpeed(double room, double hardest, double period, const Braking& braking) {
  if (room <= 0) return std::max(kReturnRate * room, -hardest);
  const double J = braking.jerk;
  return J * (std::sqrt(period * period + 2 * room / J) - period);
}

BrakingReserve::BrakingReserve(const robot::Model& model)
    : acceleration_(model.max_acceleration()),
      jerk_(model.max_jerk()),
      max_torque_(model.max_torque()),
      max_rate_(model.max_torque_rate()) {}

void BrakingReserve::Set(const Eigen::MatrixXd& M, const Eigen::VectorXd& bias, double torque_share,
                         double rate_share) {
  const int n = static_cast<int>(acceleration_.size());
  deceleration_scale_ = jerk_scale_ = 1;
  for (int i = 0; i < n; ++i) {
    double torque = 0, rate = 0;
    for (int j = 0; j < n; ++j) {
      torque += std::abs(M(i, j)) * acceleration_[j];
      rate += std::abs(M(i, j)) * jerk_[j];
    }
    const double free = torque_share * (max_torque_[i] - std::abs(bias[i]));
    deceleration_scale_ = std::min(deceleration_scale_, free / torque);
    jerk_scale_ = std::min(jerk_scale_, rate_share * max_rate_[i] / rate);
  }
  deceleration_scale_ = std::max(deceleration_scale_, kLeastShare);
}

}  // namespace tether::control
