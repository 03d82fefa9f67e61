#include "tether/execution/reference/posture_search.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "tether/math/pose_error.h"
#include "tether/robot/damped_step.h"

namespace tether::execution {
namespace {

constexpr double kMaxStep = 0.3;          // rad
constexpr double kReached = 0.005;        // m
constexpr double kEnoughRoom = 0.35;      // rad: more room than this is no better.
constexpr double kRoomThatMatters = 0.1;  // rad
// A plan's joints are of use if the hand that they give is this near to where it shall be.
constexpr double kFits = 0.3;      // m
constexpr double kFitsTurned = 1;  // rad

}  // namespace

PostureSearch::PostureSearch(const std::shared_ptr<const robot::Model>& model)
    : model_(model),
      state_(model),
      start_(model->home()),
      rest_(model->home()),
      zero_(Eigen::VectorXd::Zero(model->dof())),
      step_(zero_),
      candidates_(kMaxCandidates) {
  for (Candidate& candidate : candidates_) candidate.q = model->home();
}

void PostureSearch::Start(const Eigen::VectorXd& q, const math::Pose* X_BH, int count,
                          const Eigen::VectorXd* ik_solution) {
  assert(count >= 1 && count <= kMaxCandidates);
  start_ = q;
  count_ = count;
  iteration_ = 0;
  best_ = 0;
  for (int i = 0; i < count; ++i) {
    candidates_[i].X_BH = X_BH[i];
    candidates_[i].q = q;
  }
  planned_ = ik_solution != nullptr && ik_solution->size() == q.size();
  if (planned_) {
    // Where the object was moved far, or was grasped with the hand turned by half a turn, the plan's joints
    // don't fit.
    state_.Set(*ik_solution, zero_);
    planned_ = (state_.X_BH().p - X_BH[0].p).norm() < kFits &&
               math::AngleBetween(state_.X_BH().R, X_BH[0].R) < kFitsTurned;
  }
  rest_ = planned_ ? *ik_solution : model_->home();
  if (planned_) candidates_[0].q = *ik_solution;
}

void PostureSearch::Advance() {
  if (done()) return;
  for (int i = 0; i < count_; ++i) Improve(candidates_[i]);
  if (++iteration_ >= kIterations) Choose();
}

bool PostureSearch::reached() const { return candidates_[best_].error < kReached; }
const Eigen::VectorXd& PostureSearch::q() const { return candidates_[best_].q; }

void PostureSearch::Improve(Candidate& candidate) {
  state_.Set(candidate.q, zero_);
  const math::Vector6d e = math::PoseError(state_.X_BH(), candidate.X_BH);
  candidate.error = e.head<3>().norm() + 0.2 * e.tail<3>().norm();
  // Towards rest within the null space, so that the answer does not depend on where the arm happens to be.
  step_ = 0.1 * (rest_ - candidate.q);
  robot::TakeDampedStep(*model_, state_.J_BH(), e, kMaxStep, &step_, &candidate.q);
}

void PostureSearch::Choose() {
  for (int i = 0; i < count_; ++i) {
    Candidate& c = candidates_[i];
    c.room = std::min({(c.q - model_->lower()).minCoeff(), (model_->upper() - c.q).minCoeff(), kEnoughRoom});
    c.motion = (c.q - start_).cwiseAbs().maxCoeff();
  }
  if (planned_ && candidates_[0].error < kReached) return;
  for (int i = 1; i < count_; ++i) {
    const Candidate& a = candidates_[best_];
    const Candidate& b = candidates_[i];
    const bool a_reached = a.error < kReached;
    const bool b_reached = b.error < kReached;
    bool better = b.motion < a.motion;
    if (std::abs(a.room - b.room) > kRoomThatMatters) better = b.room > a.room;
    if (a_reached != b_reached) better = b_reached;
    if (better) best_ = i;
  }
}

}  // namespace tether::execution
