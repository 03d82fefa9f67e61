#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tether/control/torque/constrained_torque.h"
#include "tether/control/torque/torque_limiter.h"
#include "tether/execution/sequencer/constraint_builder.h"
#include "tether/execution/servo/situation.h"

namespace tether::execution {

/// Follows objectives with torques: the constrained controller with the limiter behind it. Compute()
/// allocates nothing.
class TorqueDrive {
 public:
  TorqueDrive(std::shared_ptr<const robot::Model> model, const ControlScene& scene, BuiltConstraints built,
              control::TorqueOptions options);

  void SetExtraFields(std::vector<control::FieldConstraint> fields) {
    controller_.SetExtraFields(std::move(fields));
  }
  void Allow(std::span<const std::pair<int, int>> pairs) { controller_.Allow(pairs); }
  void Hold(int object) { controller_.Hold(object); }
  void Release() { controller_.Release(); }

  /// Torques that lead towards the goal (null: the arm stays where it is) and press with no more than
  /// `max_force`, N.
  const Eigen::VectorXd& Compute(const Situation& situation, const control::Goal* goal, double max_force);
  const control::ConstrainedTorque& controller() const { return controller_; }

 private:
  robot::State state_;
  control::ConstrainedTorque controller_;
  control::TorqueLimiter limiter_;
  control::Goal stay_;
  bool stays_ = false;
  Eigen::VectorXd carried_;
};

}  // namespace tether::execution
