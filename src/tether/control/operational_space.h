#pragma once

#include <memory>

#include <Eigen/Core>

#include "tether/math/pose.h"
#include "tether/robot/model.h"

namespace tether::control {

/// Gains of the operational-space controller. Paper A, appendix B.
struct OperationalSpaceGains {
  double position = 400;           ///< k_p, 1/s²
  double position_damping = 40;    ///< k_v, 1/s
  double rotation = 400;           ///< 1/s²
  double rotation_damping = 40;    ///< 1/s
  double posture = 10;             ///< null space, 1/s²
  double posture_damping = 6;      ///< null space, 1/s
  double obstacle_damping = 20;    ///< k_obs, 1/s
  /// Throws InputError naming the field that is not finite or not positive.
  void Validate() const;
};

/// Where the hand should be, and how it should be moving: a target frame that moves is fed forward.
struct HandTarget {
  math::Pose X_BH;                                       ///< Desired hand pose in the base frame.
  math::Vector6d V_BH = math::Vector6d::Zero();          ///< Desired (linear, angular) velocity in the base frame.
  /// Unit direction (base frame) from the hand's nearest body to the nearest obstacle, or zero: velocity along it is
  /// damped. Paper A, eq. (31), with the gradient of the distance as direction (ERRATA A10).
  Eigen::Vector3d toward_obstacle = Eigen::Vector3d::Zero();
};

/// Torque-level servo of the hand to a target: Paper A, appendix B. τ = Jᵀ Λ ẍ_des + null-space posture + bias. The
/// posture task also pushes joints away from their limits; torques are kept within the model's limits. Allocates nothing
/// after construction.
class OperationalSpaceController {
 public:
  OperationalSpaceController(std::shared_ptr<const robot::Model> model, const OperationalSpaceGains& gains,
                             const Eigen::VectorXd& posture);

  /// Torques for one tick, n, Nm, within the model's limits. `state` must be set to the measured configuration.
  const Eigen::VectorXd& Compute(const robot::State& state, const HandTarget& target);

  void set_posture(const Eigen::VectorXd& posture);

 private:
  std::shared_ptr<const robot::Model> model_;
  OperationalSpaceGains gains_;
  Eigen::VectorXd posture_;
  Eigen::VectorXd torque_;
};

}  // namespace tether::control
