#include "tether/execution/reference/reach_search.h"

#include <limits>

#include "tether/math/pose_error.h"
#include "tether/robot/damped_step.h"

namespace tether::execution {
namespace {

constexpr double kMaxStep = 0.4;  // rad
// What a radian counts, m, and errors that are none.
constexpr double kLever = 0.2;
constexpr double kThere = 0.004;       // m
constexpr double kThereAngle = 0.025;  // rad

}  // namespace

ReachSearch::ReachSearch(const std::shared_ptr<const robot::Model>& model)
    : model_(model),
      kinematics_(model),
      q_(model->home()),
      given_(q_),
      other_(q_),
      zero_(Eigen::VectorXd::Zero(model->dof())),
      step_(zero_) {}

void ReachSearch::Start(const math::Pose& X_BH, const Eigen::VectorXd& q, const Eigen::VectorXd& other) {
  X_BH_ = X_BH;
  given_ = q;
  other_ = other.size() == q.size() ? other : model_->home();
  random_ = Random(1);
  start_ = -1;
  least_ = nearest_m_ = nearest_rad_ = std::numeric_limits<double>::infinity();
  state_ = State::kSearching;
  NextStart();
}

void ReachSearch::NextStart() {
  iteration_ = 0;
  if (++start_ >= kStarts) {
    state_ = State::kOutOfReach;
  } else if (start_ == 0) {
    q_ = given_;
  } else if (start_ == 1) {
    q_ = other_;
  } else if (start_ == 2) {
    q_ = model_->home();
  } else {
    for (int i = 0; i < q_.size(); ++i) q_[i] = random_.Uniform(model_->lower()[i], model_->upper()[i]);
  }
}

void ReachSearch::Advance() {
  if (state_ != State::kSearching) return;
  kinematics_.Set(q_, zero_);
  const math::Vector6d e = math::PoseError(kinematics_.X_BH(), X_BH_);
  const double off_m = e.head<3>().norm(), off_rad = e.tail<3>().norm();
  if (off_m + kLever * off_rad < least_) {
    least_ = off_m + kLever * off_rad;
    nearest_m_ = off_m;
    nearest_rad_ = off_rad;
  }
  if (off_m < kThere && off_rad < kThereAngle) {
    state_ = State::kReached;
    return;
  }
  if (++iteration_ > kIterations) return NextStart();
  step_.setZero();
  robot::TakeDampedStep(*model_, kinematics_.J_BH(), e, kMaxStep, &step_, &q_);
}

}  // namespace tether::execution
