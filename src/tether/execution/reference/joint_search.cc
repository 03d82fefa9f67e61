#include "tether/execution/reference/joint_search.h"

#include <cassert>
#include <limits>

namespace tether::execution {
namespace {

// Errors that are none.
constexpr double kThere = 0.004;       // m
constexpr double kThereAngle = 0.025;  // rad

}  // namespace

JointSearch::JointSearch(const std::shared_ptr<const robot::Model>& model)
    : model_(model), q_(model->home()) {
  first_.fill(q_);
}

void JointSearch::Begin(std::initializer_list<const Eigen::VectorXd*> first) {
  assert(first.size() <= first_.size());
  num_first_ = 0;
  for (const Eigen::VectorXd* q : first) first_[num_first_++] = *q;
  random_ = Random(1);
  start_ = -1;
  least_ = nearest_m_ = nearest_rad_ = std::numeric_limits<double>::infinity();
  state_ = State::kSearching;
  NextStart();
}

void JointSearch::NextStart() {
  iteration_ = 0;
  if (++start_ >= kStarts) {
    state_ = State::kOutOfReach;
  } else if (start_ < num_first_) {
    q_ = first_[start_];
  } else {
    for (int i = 0; i < q_.size(); ++i) q_[i] = random_.Uniform(model_->lower()[i], model_->upper()[i]);
  }
}

bool JointSearch::TakesStep(double off_m, double off_rad) {
  if (off_m + kLever * off_rad < least_) {
    least_ = off_m + kLever * off_rad;
    nearest_m_ = off_m;
    nearest_rad_ = off_rad;
  }
  if (off_m < kThere && off_rad < kThereAngle) {
    state_ = State::kReached;
    return false;
  }
  if (++iteration_ <= kIterations) return true;
  NextStart();
  return false;
}

}  // namespace tether::execution
