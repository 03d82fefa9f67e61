#include "tether/execution/observer/frame_tracker.h"

#include <cmath>

namespace tether::execution {

void FrameTracker::Reset(const math::Pose& X_WF, double time) {
  X_WF_ = X_WF;
  V_WF_.setZero();
  time_ = time;
  measured_ = time;
}

void FrameTracker::Predict(double time) {
  const double dt = time - time_;
  if (dt <= 0) return;
  time_ = time;
  X_WF_.p += dt * V_WF_.head<3>();
  const Eigen::Vector3d turn = dt * V_WF_.tail<3>();
  if (!turn.isZero(0)) X_WF_.R = math::ExpSO3(turn) * X_WF_.R;
}

void FrameTracker::Correct(const math::Pose& X_WF) {
  const double dt = time_ - measured_;
  if (dt <= 0) return;
  measured_ = time_;
  const double decay = std::exp(-bandwidth_ * dt);
  const double alpha = 1 - decay * decay;
  const double beta = (1 - decay) * (1 - decay) / dt;
  const Eigen::Vector3d shift = X_WF.p - X_WF_.p;
  const Eigen::Vector3d turn = math::LogSO3(X_WF.R * X_WF_.R.transpose());
  X_WF_.p += alpha * shift;
  X_WF_.R = math::ProjectToSO3(math::ExpSO3(alpha * turn) * X_WF_.R);
  V_WF_.head<3>() += beta * shift;
  V_WF_.tail<3>() += beta * turn;
}

}  // namespace tether::execution
