#pragma once

#include <Eigen/Core>

#include "tether/math/pose.h"
#include "tether/robot/model.h"

namespace tether::robot {

/// One step of damped least-squares inverse kinematics, as searches take it that run beside a controller:
///
///   q ← clamp(q + z + Jᵀ (J Jᵀ + λ² I)⁻¹ (e − J z)),  λ = 0.02,
///
/// where z is what the joints would rather do: it counts within the null space. The step is shortened until
/// no joint moves by more than `max_step`. J: 6 × n, of the hand in the base frame; `error`: what leads to
/// the pose that is wanted (math::PoseError; m, rad); `step`: n, rad, z at first and the step that was taken
/// afterwards; `q`: n, rad. Allocates nothing.
void TakeDampedStep(const Model& model, const Eigen::MatrixXd& J, const math::Vector6d& error,
                    double max_step, Eigen::VectorXd* step, Eigen::VectorXd* q);

}  // namespace tether::robot
