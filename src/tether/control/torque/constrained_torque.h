#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "tether/control/constrained_velocity.h"
#include "tether/control/load_estimator.h"
#include "tether/control/operational_space.h"
#include "tether/control/torque/contact_watch.h"
#include "tether/robot/model.h"

namespace tether::control {

/// How the torque controller is set.
struct TorqueOptions {
  OperationalSpaceGains gains;  ///< Of (30b), for functions of a Goal too, and of the posture.
  double period = 0.001;        ///< Between ticks, s.
  /// What ‖q̈ − q̈_posture‖²_M counts beside the square of the hand's acceleration, 1/kg: directions in which
  /// the hand's mobility is less than this are given up.
  double null_weight = 5e-3;
  double rotation_weight = 0.2;  ///< What a radian counts, m.
  double field_rate = 20;        ///< Distances shrink no faster than at this rate, 1/s …
  double field_damping = 40;  ///< … which they are brought to at this one, 1/s: barriers of second order.
  /// What of the decelerations and jerks that all joints have at once is counted on for a distance …
  double field_share = 0.5;
  double field_braking = 6;      ///< … and no deceleration beyond this, m/s² or rad/s².
  double buffer = 0.002;         ///< Added to each safe distance, m …
  double angle_buffer = 0.005;   ///< … and to each angle, rad.
  double velocity_share = 0.95;  ///< Of the joints' greatest velocities.
  double torque_share = 0.8;     ///< Of the torque that is free, counted on for braking …
  double rate_share = 0.6;       ///< … and of the torque rate.
  double rate_margin = 0.995;    ///< Of the torque rate that commands use.
  double joint_margin = 0;       ///< From the limits towards the middle of the range, rad.
  double limit_gap = 0.01;       ///< From the limits, for what the model does not know, rad.
  double return_speed = 0.1;     ///< At which joints come back from beyond a limit, rad/s.
  double self_distance = 0.005;  ///< Between parts of the arm, m.
  double range = 0.25;  ///< Pairs further apart than their safe distance and this get no row, m; nor do
                        ///< those that close in too slowly to matter.
  /// That a row asks for, m/s² or rad/s²: what gets in the arm's way meanwhile is pressed with so much times
  /// its mass.
  double most_needed = 12;
  double lead = 0.06;      ///< Moving objects are kept clear of by what they move in this time as well, s.
  double brake_rate = 20;  ///< Of joint velocities, where the arm only brakes, 1/s.
  ContactOptions contact;
  LoadEstimatorOptions load;  ///< The period is the controller's.
  int max_iterations = 60;    ///< Of the QP …
  int max_solves = 60;        ///< … and QPs where rows conflict. Beyond, the arm brakes.
  /// Throws InputError naming every field that is not finite or out of bounds.
  void Validate() const;
};

/// What the arm and the world look like at a tick.
struct TorqueInput {
  const robot::State& state;                  ///< Set to what was measured.
  double opening = 0;                         ///< Of the gripper, m.
  std::span<const MovingPose> objects;        ///< In the world, in the order they were given.
  const Eigen::VectorXd* external = nullptr;  ///< n, Nm: torques due to contact and payload, if measured.
};

/// What the arm is to do in a tick: lead the hand, functions of frames, both, or stand still.
struct TorqueTask {
  const HandTarget* hand = nullptr;  ///< Tracked with Paper A, eq. (30). Its F_BH is carried; without,
                                     ///< what load() says.
  const Goal* goal = nullptr;        ///< Functions to bring to zero, at limited speeds.
  const Eigen::VectorXd* posture = nullptr;  ///< Where redundancy leads, n, rad.
  double max_force = 40;                     ///< That the servo presses with, N.
  const JointTarget* joints = nullptr;       ///< A path of the whole arm, in place of the posture.
  /// n, rad/s: joint velocities to follow in place of all that, of a controller that keeps the constraints.
  const Eigen::VectorXd* velocities = nullptr;
};

/// What the last tick had to do besides following its task.
struct TorqueFlags {
  bool fault = false;     ///< The input or a row was not finite: the arm brakes.
  bool braking = false;   ///< No solution within the bound of iterations: the arm brakes.
  bool conflict = false;  ///< Rows conflicted …
  bool relaxed =
      false;  ///< … and constraints were relaxed; in their order, the largest violation was minimised.
  bool violated = false;     ///< A constraint is violated.
  bool joint_limit = false;  ///< A joint is held by its position or velocity limit.
  bool torque_limit = false;
  bool rate_limit = false;
  bool force_limit = false;  ///< The servo would have pressed with more than `max_force`.
  bool singular = false;     ///< The hand can hardly move in some direction.
  bool outside = false;      ///< A joint is beyond its limit; it comes back.
  bool yielding = false;     ///< Something is touched that should not be; the arm backs off.
  int worst = -1;            ///< Constraint of the most violated row, for constraint_name().
  double violation = 0;      ///< Its depth, m or rad; of a conflict, m/s² or rad/s².
  int iterations = 0;        ///< Of the QP, all together.
};

/// Constrained control with torques. In every tick
///
///   min ‖J q̈ + J̇ q̇ − ẍ_goal‖² + ρ ‖q̈ − q̈_posture‖²_M   subject to
///     |τ| ≤ τ_max,  |τ − τ_last| ≤ τ̇_max T,  τ = M q̈ + h,
///     q̈ such that each joint can still brake before its limits, with the torque and the torque rate that are
///     there (joint_braking.h), and stays below its greatest velocity, acceleration and jerk, whatever pushes
///     the arm meanwhile (as felt in τ_ext),
///     d̈ ≥ −(k + κ) ḋ − k κ (d − d_safe)  for each constraint (a barrier of second order), and such that its
///     approach can still be braked before d_safe, with the torque and the torque rate that are there,
///
/// with Paper A, eq. (30), as the goal, and the inequalities of Paper B, section 2.3, that the velocity
/// controller has: clearances of links, hand and held object, fields. J̇ q̇ of every row is exact.
///
/// If rows conflict they hold in this order: torque rate and torque, velocity, position, constraints that may
/// not be relaxed, those that may (highest `relax` first), acceleration and jerk. What is asked of a row is
/// never more than the torques can give in a tick, so that a lone row does not conflict. With no solution
/// within the bounds of iterations, the arm brakes; so it does if an input is not finite.
///
/// Torques begin from those that hold the start pose. A contact that was not intended (ContactWatch) makes
/// the arm back off along its normal. Compute() allocates nothing, and is deterministic.
class ConstrainedTorque {
 public:
  /// Throws InputError for options that are not valid.
  ConstrainedTorque(std::shared_ptr<const robot::Model> model, const math::Pose& X_WBase,
                    const std::vector<Solid>& objects, const std::vector<ClearanceConstraint>& clearances,
                    std::vector<FieldConstraint> fields, const TorqueOptions& options);
  ~ConstrainedTorque();
  ConstrainedTorque(ConstrainedTorque&&) noexcept;
  ConstrainedTorque& operator=(ConstrainedTorque&&) noexcept;

  const ArmBodies& bodies() const;
  const TorqueOptions& options() const;
  /// Replaces the fields that were added after construction. Allocates.
  void SetExtraFields(std::vector<FieldConstraint> fields);
  /// Pairs of bodies that may touch, in place of those before; −1 stands for the held object. Allocates
  /// nothing.
  void Allow(std::span<const std::pair<int, int>> pairs);
  void Hold(int object);
  void Release();

  /// Torques for one tick, n, Nm: finite, within torque and torque rate.
  const Eigen::VectorXd& Compute(const TorqueInput& input, const TorqueTask& task);
  /// What the robot was in fact told, if not what Compute() said: the rate counts from there.
  void SetLast(const Eigen::VectorXd& torque);
  /// Forgets the last torques: the next tick counts from those that hold its pose.
  void Restart();

  const TorqueFlags& flags() const;
  const Contact& contact() const;
  /// n, Nm: external torques that are neither payload nor errors of sensors, filtered.
  const Eigen::VectorXd& felt() const;
  /// What the hand carries, told from the external torques, and by what they are off.
  const LoadEstimator& load() const;
  /// The accelerations that the last torques are for, n, rad/s².
  const Eigen::VectorXd& acceleration() const;
  /// The goal's functions at the last tick: the largest norm in m and in rad.
  double error_m() const;
  double error_rad() const;

  /// One row of the last tick, for tests and for explanations.
  struct Row {
    int constraint = 0;
    double value =
        0;  ///< What is kept above zero: a distance less what is required and the buffer, m or rad.
    double buffer = 0;  ///< m or rad
    double rate = 0;    ///< d(value)/dt
    double bias = 0;    ///< d²(value)/dt² without joint accelerations.
    double needed = 0;  ///< d²(value)/dt² must not be below this.
    Priority priority = 0;
    int a = -1, b = -1;    ///< The bodies, of a clearance.
    bool allowed = false;  ///< The bodies may touch: no row, only watched for contact.
    bool binding = false;  ///< It keeps the arm from accelerating as it would.
  };
  int num_rows() const;
  const Row& row(int index) const;
  /// The derivative of a row's value in q.
  Eigen::RowVectorXd row_jacobian(int index) const;
  /// Rows that were not known to hold in any case, and so were in the QP.
  int num_qp_rows() const;
  int num_constraints() const;
  /// Constraints in the order of `clearances`, "self", `fields`, then the extra ones.
  const std::string& constraint_name(int index) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tether::control
