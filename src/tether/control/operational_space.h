#pragma once

#include <memory>

#include <Eigen/Core>

#include "tether/math/pose.h"
#include "tether/robot/model.h"

namespace tether::control {

/// Gains of the operational-space controller. Paper A, appendix B.
struct OperationalSpaceGains {
  double position = 400;            ///< k_p, 1/s²
  double position_damping = 40;     ///< k_v, 1/s
  double rotation = 400;            ///< 1/s²
  double rotation_damping = 40;     ///< 1/s
  double posture = 10;              ///< null space, 1/s²
  double posture_damping = 6;       ///< null space, 1/s
  double obstacle_damping = 20;     ///< k_obs, 1/s
  double limit_margin = 0.3;        ///< The null space pushes joints away from limits nearer than this, rad.
  double limit_push = 40;           ///< That push at the limit itself, rad/s²
  double max_position_error = 0.1;  ///< Longer position errors act as this long, m.
  double max_rotation_error = 0.6;  ///< Larger rotation errors act as this large, rad.
  /// Throws InputError naming every field that is not finite or not positive.
  void Validate() const;
};

/// Where the hand should be, and how it should be moving: a target frame that moves is fed forward.
struct HandTarget {
  math::Pose X_BH;                               ///< Desired hand pose in the base frame.
  math::Vector6d V_BH = math::Vector6d::Zero();  ///< Desired (linear, angular) velocity in the base frame.
  math::Vector6d A_BH = math::Vector6d::Zero();  ///< Its derivative, fed forward.
  math::Vector6d F_BH =
      math::Vector6d::Zero();  ///< (Force N, moment Nm) to exert at the hand's origin, base frame.
  /// Unit direction (base frame) from the hand's nearest body to the nearest obstacle, or zero: velocity
  /// along it is damped. Paper A, eq. (31), with the gradient of the distance as direction (ERRATA A10).
  Eigen::Vector3d toward_obstacle = Eigen::Vector3d::Zero();
  /// Share of the obstacle damping that acts, in [0, 1]: how near the obstacle is.
  double obstacle_weight = 1;
};

/// Where all joints should be, and how they should be moving: a path of the whole arm that is followed, and
/// that the hand's target is on. n each: rad, rad/s, rad/s².
struct JointTarget {
  const Eigen::VectorXd& q;
  const Eigen::VectorXd& v;
  const Eigen::VectorXd& a;
};

/// The joint accelerations that follow it, with the gains of the hand's position. Allocates nothing.
void FollowJoints(const OperationalSpaceGains& gains, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                  const JointTarget& target, Eigen::VectorXd* acceleration);

/// Whether every number is finite.
bool IsFinite(const HandTarget& target);

/// What the hand's acceleration (linear, angular; base frame) should be: Paper A, eqs. (30b) and (31c)–(31d),
/// with the target's motion fed forward, and long errors shortened. `V_BH`: the hand's velocity.
math::Vector6d DesiredHandAcceleration(const OperationalSpaceGains& gains, const math::Pose& X_BH,
                                       const math::Vector6d& V_BH, const HandTarget& target);

/// What kept the last torques from being the plain operational-space law. None is an error: the torques are
/// safe.
struct ControlFlags {
  bool fault = false;     ///< The state or the target was not finite: the arm is braked, gravity is carried.
  bool singular = false;  ///< The inverse was damped: the arm is near a singularity.
  bool joint_limit = false;   ///< A joint was braked before a position or velocity limit.
  bool torque_limit = false;  ///< The torques were scaled down to the model's limits.
};

/// Torque-level servo of the hand to a target: Paper A, appendix B. With J the hand's Jacobian, M the inertia
/// and Λ = (J M⁻¹ Jᵀ)⁻¹,
///
///   τ = Jᵀ Λ (a_target + k_p e + k_v ė + a_obstacle) + Jᵀ F + (1 − Jᵀ Λ J M⁻¹) M q̈_posture + τ_limits +
///   bias.
///
/// The orientation part of e is a rotation vector. Directions in which the arm can hardly accelerate (near a
/// singularity) get a damped inverse. The posture task also pushes joints away from their limits; joints are
/// braked before position and velocity limits whatever the task's acceleration; torques are kept within the
/// model's limits, by scaling all but gravity. Allocates nothing after construction.
class OperationalSpaceController {
 public:
  /// `posture`: n joint positions that the null space is drawn to, rad. Throws InputError for gains that are
  /// not valid.
  OperationalSpaceController(std::shared_ptr<const robot::Model> model, const OperationalSpaceGains& gains,
                             const Eigen::VectorXd& posture);
  ~OperationalSpaceController();
  OperationalSpaceController(OperationalSpaceController&&) noexcept;
  OperationalSpaceController& operator=(OperationalSpaceController&&) noexcept;

  /// Torques for one tick, n, Nm, within the model's limits and always finite. `state` must be set to the
  /// measured configuration.
  /// With `joints`, they are followed in place of the posture.
  const Eigen::VectorXd& Compute(const robot::State& state, const HandTarget& target,
                                 const JointTarget* joints = nullptr);

  /// What happened in the last Compute().
  const ControlFlags& flags() const;
  const Eigen::VectorXd& posture() const;
  void set_posture(const Eigen::VectorXd& posture);

 private:
  struct Workspace;
  std::unique_ptr<Workspace> work_;
};

}  // namespace tether::control
