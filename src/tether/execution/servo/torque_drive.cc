#include "tether/execution/servo/torque_drive.h"

#include <algorithm>

#include "tether/robot/gravity.h"

namespace tether::execution {
namespace {

Eigen::Vector3d GravityIn(const math::Pose& X_WB) {
  return X_WB.R.transpose() * Eigen::Vector3d(0, 0, -robot::kGravity);
}

control::TorqueOptions WithMargin(control::TorqueOptions options, double margin) {
  options.joint_margin = std::max(options.joint_margin, margin);
  return options;
}

}  // namespace

TorqueDrive::TorqueDrive(std::shared_ptr<const robot::Model> model, const ControlScene& scene,
                         BuiltConstraints built, control::TorqueOptions options)
    : state_(model, GravityIn(scene.X_WBase())),
      controller_(model, scene.X_WBase(), scene.solids(), std::move(built.clearances),
                  std::move(built.fields), WithMargin(options, built.joint_margin)),
      limiter_(model, {.period = options.period}),
      carried_(Eigen::VectorXd::Zero(model->dof())) {
  stay_.posture = model->home();
}

const Eigen::VectorXd& TorqueDrive::Compute(const Situation& situation, const control::Goal* goal,
                                            double max_force) {
  state_.Set(situation.q, situation.v);
  if (goal != nullptr) {
    stays_ = false;
  } else {
    if (!stays_ && situation.q.allFinite()) {
      stays_ = true;
      stay_.posture = situation.q;
    }
    goal = &stay_;
  }
  control::TorqueTask task;
  task.goal = goal;
  task.max_force = max_force;
  const Eigen::VectorXd& wanted =
      controller_.Compute({state_, situation.opening, situation.objects, &situation.tau_external}, task);
  carried_.noalias() = state_.J_BH().transpose() * controller_.load().Holding(state_.X_BH());
  const Eigen::VectorXd& torque = limiter_.Limit(state_, wanted, &carried_, &controller_.felt());
  controller_.SetLast(torque);
  return torque;
}

}  // namespace tether::execution
