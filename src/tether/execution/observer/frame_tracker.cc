#include "tether/execution/observer/frame_tracker.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tether/math/pose_error.h"

namespace tether::execution {
namespace {

// Where measurements scatter, the bandwidth falls to this, 1/s.
constexpr double kLeastBandwidth = 4;
// Innovations are compared over about this time, s.
constexpr double kCompare = 0.15;
// Innovations that scatter still agree by chance; so many standard deviations of that are none.
constexpr double kByChance = 1.6;

}  // namespace

void FrameTracker::Agreement::Add(const Eigen::Vector3d& innovation, double share) {
  mean += share * (innovation - mean);
  size += share * (innovation.norm() - size);
  weight = share;
}

double FrameTracker::Agreement::ratio() const {
  const double chance = std::min(0.9, kByChance * std::sqrt(weight / (2 - weight)));
  return std::clamp((mean.norm() / size - chance) / (1 - chance), 0.0, 1.0);
}

double FrameTracker::Bandwidth(const Agreement& agreement) const {
  if (agreement.exact()) return bandwidth_;
  const double least = std::min(bandwidth_, kLeastBandwidth);
  return least + agreement.ratio() * (bandwidth_ - least);
}

void FrameTracker::Reset(const math::Pose& X_WF, double time) {
  X_WF_ = X_WF;
  V_WF_.setZero();
  time_ = time;
  measured_ = time;
  position_ = {position_.none};
  rotation_ = {rotation_.none};
}

math::Pose FrameTracker::At(double time) const {
  const double dt = time - time_;
  if (dt <= 0) return X_WF_;
  const Eigen::Vector3d turn = dt * V_WF_.tail<3>();
  return {turn.isZero(0) ? X_WF_.R : Eigen::Matrix3d(math::ExpSO3(turn) * X_WF_.R),
          X_WF_.p + dt * V_WF_.head<3>()};
}

void FrameTracker::Predict(double time) {
  if (time <= time_) return;
  X_WF_ = At(time);
  time_ = time;
}

void FrameTracker::Correct(const math::Pose& X_WF) {
  const double dt = time_ - measured_;
  if (dt <= 0) return;
  measured_ = time_;
  const math::Vector6d error = math::PoseError(X_WF_, X_WF);
  const Eigen::Vector3d shift = error.head<3>(), turn = error.tail<3>();
  const double share = 1 - std::exp(-dt / kCompare);
  position_.Add(shift, share);
  rotation_.Add(turn, share);
  const auto gains = [dt](double bandwidth) {
    const double decay = std::exp(-bandwidth * dt);
    return std::pair{1 - decay * decay, (1 - decay) * (1 - decay) / dt};
  };
  const auto [alpha, beta] = gains(Bandwidth(position_));
  X_WF_.p += alpha * shift;
  V_WF_.head<3>() += beta * shift;
  const auto [alpha_turn, beta_turn] = gains(Bandwidth(rotation_));
  X_WF_.R = math::ProjectToSO3(math::ExpSO3(alpha_turn * turn) * X_WF_.R);
  V_WF_.tail<3>() += beta_turn * turn;
}

}  // namespace tether::execution
