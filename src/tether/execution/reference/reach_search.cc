#include "tether/execution/reference/reach_search.h"

#include "tether/math/pose_error.h"
#include "tether/robot/damped_step.h"

namespace tether::execution {

ReachSearch::ReachSearch(const std::shared_ptr<const robot::Model>& model)
    : JointSearch(model), kinematics_(model), zero_(Eigen::VectorXd::Zero(model->dof())), step_(zero_) {}

void ReachSearch::Start(const math::Pose& X_BH, const Eigen::VectorXd& q, const Eigen::VectorXd& other) {
  X_BH_ = X_BH;
  const Eigen::VectorXd& home = model_->home();
  Begin({&q, other.size() == q.size() ? &other : &home, &home});
}

void ReachSearch::Advance() {
  if (state_ != State::kSearching) return;
  kinematics_.Set(q_, zero_);
  const math::Vector6d e = math::PoseError(kinematics_.X_BH(), X_BH_);
  if (!TakesStep(e.head<3>().norm(), e.tail<3>().norm())) return;
  step_.setZero();
  robot::TakeDampedStep(*model_, kinematics_.J_BH(), e, kMaxStep, &step_, &q_);
}

}  // namespace tether::execution
