#include "tether/execution/reference/goal_search.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>

#include "tether/robot/model.h"

namespace tether::execution {
namespace {

using Eigen::Vector3d;

constexpr double kDamping = 0.02;

}  // namespace

GoalSearch::GoalSearch(const std::shared_ptr<const robot::Model>& model)
    : JointSearch(model),
      kinematics_(model),
      step_(Eigen::VectorXd::Zero(model->dof())),
      J_BH_(6, model->dof()) {}

void GoalSearch::Start(std::vector<constraints::PoseFunctionPtr> functions, const math::Pose& X_BTarget,
                       const math::Pose& X_HF, const Eigen::VectorXd& q) {
  functions_ = std::move(functions);
  int size = 0, largest = 0;
  for (const auto& function : functions_) {
    size += function->size();
    largest = std::max(largest, function->size());
  }
  assert(size <= kMostRows);
  r_.setZero(size);
  J_.setZero(size, model_->dof());
  rows_r_.setZero(largest);
  rows_J_.setZero(largest, 12);
  X_BT_ = X_BTarget;
  X_HF_ = X_HF;
  Begin({&q, &model_->home()});
  if (size == 0) state_ = State::kReached;
}

int GoalSearch::Evaluate(double* off_m, double* off_rad) {
  kinematics_.Set(q_);
  kinematics_.HandJacobian(J_BH_);
  const math::Pose X_BF = kinematics_.X_BH() * X_HF_;
  const Vector3d arm = X_BF.p - kinematics_.X_BH().p;
  const std::array<math::Pose, 2> X = {X_BT_, X_BF};
  int row = 0;
  *off_m = *off_rad = 0;
  for (const auto& function : functions_) {
    const int size = function->size();
    nlp::JacobianRef J(rows_J_.topRows(size));
    function->Evaluate(X, rows_r_.head(size), &J);
    const bool metres = function->unit() == nlp::Unit::kMetre;
    const double norm = rows_r_.head(size).norm(), weight = metres ? 1 : kLever;
    (metres ? *off_m : *off_rad) = std::max(metres ? *off_m : *off_rad, norm);
    for (int i = 0; i < size; ++i, ++row) {
      const Vector3d along = X_BF.R * rows_J_.row(i).segment<3>(6).transpose();
      const Vector3d about = X_BF.R * rows_J_.row(i).segment<3>(9).transpose();
      r_[row] = weight * rows_r_[i];
      // Of a point at `arm` from the hand's origin: v + ω × arm.
      J_.row(row) = weight * (along.transpose() * J_BH_.topRows<3>() +
                              (about + arm.cross(along)).transpose() * J_BH_.bottomRows<3>());
    }
  }
  return row;
}

void GoalSearch::Advance() {
  if (state_ != State::kSearching) return;
  double off_m = 0, off_rad = 0;
  const int rows = Evaluate(&off_m, &off_rad);
  if (!TakesStep(off_m, off_rad)) return;
  JJt_.noalias() = J_ * J_.transpose();
  JJt_.diagonal().array() += kDamping * kDamping;
  const Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMostRows, 1> y =
      JJt_.ldlt().solve(r_.head(rows));
  step_.noalias() = -J_.transpose() * y;
  const double largest = step_.cwiseAbs().maxCoeff();
  if (largest > kMaxStep) step_ *= kMaxStep / largest;
  q_ = (q_ + step_).cwiseMax(model_->lower()).cwiseMin(model_->upper());
}

}  // namespace tether::execution
