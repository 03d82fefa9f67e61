#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "tether/constraints/core/pose_function.h"
#include "tether/control/arm_bodies.h"
#include "tether/robot/model.h"

namespace tether::control {

/// Settings of the velocity controller. Paper B uses a gain of 100 and a damping of 0.001 at 200 Hz.
struct VelocityOptions {
  double gain = 1;               ///< η of eq. (2): errors of the objective decay at this rate, 1/s.
  double damping = 0.001;        ///< λ of eq. (2), on ‖q̇‖² beside m²/s².
  double rotation_weight = 0.3;  ///< What a radian counts in the objective, m.
  double field_gain = 5;    ///< η of the inequalities: distances shrink no faster than at this rate, 1/s.
  double joint_gain = 5;    ///< k of eq. (13), 1/s.
  double joint_margin = 0;  ///< From the limits towards the middle of the range (ERRATA B2), rad.
  double buffer = 0.002;    ///< Added to each safe distance, for the lag of the arm's servo, m …
  double angle_buffer = 0.005;   ///< … and to each angle, rad.
  double velocity_share = 0.95;  ///< Of the joints' greatest velocities.
  /// What the robot's servo overshoots a change of velocity by, as a share of the change: commands keep so
  /// far from the limits that the joints stay within them.
  double servo_overshoot = 0.16;
  double ramp = 0.2;  ///< Time from rest to a joint's greatest velocity, s; 0: no bound on changes at all.
  double period = 0.005;         ///< Between ticks, s.
  double self_distance = 0.005;  ///< Between parts of the arm, m.
  double range = 0.15;           ///< Pairs further apart than their safe distance and this get no row, m.
  /// In the goal's null space, joints outside of this share of their range return to it, at this rate, 1/s,
  /// and no faster than this, rad/s: an arm that drifts folds in the end. A gain of 0: it drifts.
  double posture_gain = 0.5;
  double posture_share = 0.75;
  double posture_speed = 0.25;
  double escape_speed = 0.05;  ///< At which a violated row is left, m/s or rad/s; goals are followed no
                               ///< faster meanwhile.
  /// Throws InputError naming every field that is not finite or out of bounds.
  void Validate() const;
};

/// A constraint's priority level: 0 comes right after the joints' limits; constraints that may be relaxed
/// have 1 or more, and the highest number is relaxed first.
using Priority = int;

/// Two sets of bodies, as in ArmBodies, that keep a distance. Pairs that the arm cannot move are left out.
struct ClearanceConstraint {
  std::string name;
  std::vector<int> of;  ///< Bodies of the arm.
  bool held = false;    ///< The object in the hand as well.
  std::vector<int> to;  ///< Indices of objects.
  double distance = 0;  ///< m
  Priority priority = 0;
};

/// Frame::object for whatever the hand holds.
inline constexpr int kHeld = -2;

/// A frame of a constraint or objective: fixed to the hand or to an object.
struct Frame {
  int object = -1;  ///< Index, or kHeld; −1: the hand, or the robot's base for targets.
  math::Pose X_OF;  ///< In the object's, hand's or base's frame.
};

/// A function of frames (target, frame) that must not be above zero: a vector-field inequality. If the frame
/// is an object's, it counts while that is held.
struct FieldConstraint {
  std::string name;
  constraints::PoseFunctionPtr function;
  Frame target, frame;
  Priority priority = 0;
  std::optional<double> buffer = {};  ///< In place of the options', m or rad.
};

/// What the arm is to do: functions of frames (target, frame) to bring to zero.
struct Goal {
  std::vector<constraints::PoseFunctionPtr> functions;
  Frame target, frame;
  double speed = 0.25;      ///< m/s, the most that is asked of functions in m …
  double turn_speed = 1.0;  ///< … and in rad, rad/s.
  /// Joint positions to go to as well, n, rad, each joint at up to `turn_speed`; empty: none.
  Eigen::VectorXd posture;
};

/// The state of the arm and the world at a tick.
struct VelocityInput {
  const Eigen::VectorXd& q;             ///< n, rad
  double opening = 0;                   ///< Of the gripper, m.
  std::span<const MovingPose> objects;  ///< In the world, in the order they were given.
  const Eigen::VectorXd* v = nullptr;   ///< n, rad/s, as measured; null: not known.
};

/// What happened in the last tick besides following the goal.
struct VelocityFlags {
  bool fault = false;  ///< The input or a row was not finite, or the problem has no solution: the arm stops,
                       ///< on a ramp.
  bool relaxed = false;   ///< Rows conflicted; the largest violation was minimised.
  bool escaping = false;  ///< A constraint is violated; it is left at a bounded speed.
  int worst = -1;         ///< The constraint of the most violated row, for constraint_name().
  double violation = 0;   ///< Of that row's speed, m/s or rad/s, with `relaxed`; else its depth, m or rad.
};

/// Paper B, eq. (2), in every tick:
///
///   min ‖J q̇ + J_T V_T + η e‖² + λ ‖q̇‖²  subject to  ḋ ≥ −η_d (d − d_safe)  for each constraint,
///
/// with λ ‖q̇ − N q̇_p‖² in place of λ ‖q̇‖² while there is a goal: q̇_p leads joints away from their limits,
/// N is the projector on what the goal leaves free, so that redundancy has an aim and costs the goal nothing;
/// with d's own change where its obstacle moves, and bounds on q̇ from the joints' velocity, position (ERRATA
/// B2) and acceleration limits, which always hold, whatever the robot's servo overshoots. Where the rows
/// conflict, the largest violation is minimised level by level: priority 0 first, then 1, 2 … (see
/// qp::HierarchySolver). Velocities change by no more than `ramp` allows, unless a row needs it: a servo that
/// is asked for jumps overshoots.
///
/// A row is a pair of convex parts nearer than `range`, or a row of a FieldConstraint; its derivative is
/// exact. Compute() allocates nothing, and is deterministic.
class ConstrainedVelocity {
 public:
  /// Throws InputError for options that are not valid.
  ConstrainedVelocity(std::shared_ptr<const robot::Model> model, const math::Pose& X_WBase,
                      const std::vector<Solid>& objects, const std::vector<ClearanceConstraint>& clearances,
                      std::vector<FieldConstraint> fields, const VelocityOptions& options);
  ~ConstrainedVelocity();
  ConstrainedVelocity(ConstrainedVelocity&&) noexcept;
  ConstrainedVelocity& operator=(ConstrainedVelocity&&) noexcept;

  const ArmBodies& bodies() const;
  /// Replaces the fields that were added after construction: those of one verb. Allocates.
  void SetExtraFields(std::vector<FieldConstraint> fields);
  /// Pairs of bodies that may touch, in place of those before. Allocates.
  void Allow(const std::vector<std::pair<int, int>>& pairs);
  void Hold(int object);
  void Release();

  /// Joint velocities, n, rad/s: within the limits and always finite. Without a goal the arm stands still, as
  /// far as the constraints let it.
  const Eigen::VectorXd& Compute(const VelocityInput& input, const Goal* goal);

  const VelocityFlags& flags() const;
  /// Rows in the last tick's problem, without bounds.
  int num_rows() const;
  /// The goal's functions at the last tick, before any limit of speed: the largest norm in m and in rad.
  double error_m() const;
  double error_rad() const;
  /// By how much the extra fields that may not be relaxed were violated at the last tick, beyond any buffer:
  /// the largest in m and in rad, not below zero.
  double extra_violation_m() const;
  double extra_violation_rad() const;
  /// Constraints in the order of `clearances`, "self", `fields`, then the extra ones.
  int num_constraints() const;
  const std::string& constraint_name(int index) const;
  /// One line per row of the last tick, for tests and for explanations.
  struct Row {
    int constraint = 0;
    double value = 0;   ///< Distance less what is required and the buffer: not below zero, m or rad.
    double drift = 0;   ///< Its rate of change if the arm stood still, per s.
    double buffer = 0;  ///< m or rad
    Priority priority = 0;
    int a = -1, b = -1;  ///< The bodies, of a clearance.
  };
  /// Row `index` of the last tick, below num_rows().
  const Row& row(int index) const;
  /// The derivative of a row's value in q.
  Eigen::RowVectorXd row_jacobian(int index) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tether::control
