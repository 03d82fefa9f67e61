#pragma once

#include <algorithm>
#include <vector>

#include <Eigen/Cholesky>

#include "tether/control/constrained_arm.h"
#include "tether/control/constrained_velocity.h"

namespace tether::control {

/// The workspace of the controller; not for users of the room.
struct ConstrainedVelocity::Impl : ConstrainedArm<ConstrainedVelocity::Row> {
  /// A field at this tick.
  struct FieldValue {
    Eigen::MatrixXd J;
    Eigen::VectorXd r;
  };

  Impl(std::shared_ptr<const robot::Model> model_in, const math::Pose& X_WBase_in,
       const std::vector<Solid>& objects, const std::vector<ClearanceConstraint>& clearances,
       std::vector<FieldConstraint> fields_in, const VelocityOptions& options_in);

  // constrained_velocity.cc: set-up, bounds, redundancy and the solves.
  void SetRoom();
  bool TakeInput(const VelocityInput& input);
  /// Leads joints away from their limits in the null space of the goal, whose rows alone are in H.
  void AddRedundancy();
  void SetBounds(const Eigen::VectorXd* v);
  void LimitChange(int joint, const double* v);
  void NoteChange();
  void Solve();
  /// Where no velocity keeps all rows and bounds.
  void SolveConflict();
  void Fault();

  // velocity_rows.cc: the rows of constraints and goals at this tick.
  math::Pose FramePose(const Frame& frame, bool target, math::Vector6d* V) const;
  void AddPairRows();
  void AddFieldRows(const FieldConstraint& field, int constraint, FieldValue* value);
  void AddGoal(const Goal& goal);
  void AddPosture(const Goal& goal);
  double ExtraViolation(nlp::Unit unit) const;
  /// Writes row r of a function's derivative in q: frame F moves with `link`.
  void Chain(const Eigen::MatrixXd& J, int r, const math::Pose& X_BF, int link, double* row) const;
  static double Drift(const Eigen::MatrixXd& J, int r, const math::Pose& X_BT, const math::Vector6d& V_BT);
  /// The lower bound on the rate of a row's value: violation is left at a bounded speed.
  double Side(const Row& row) const {
    return std::min(-options.field_gain * row.value, options.escape_speed) - row.drift;
  }
  /// Sets derivatives at the level of rounding to zero: the arm can't change these rows. Notes rows that are
  /// not finite.
  void ClearDust();
  /// Notes what is violated beyond its buffer: nothing moves fast until nothing is.
  void FindViolation();

  VelocityOptions options;
  std::vector<FieldValue> values;  ///< Of the fields.
  Eigen::MatrixXd H;
  Eigen::VectorXd g, lower, upper;
  Eigen::VectorXd smooth_lower, smooth_upper;  ///< Those that `ramp` allows as well.
  Eigen::VectorXd qdot, last_qdot;
  Eigen::VectorXd rise,
      fall;  ///< What velocities have risen, and fallen, lately: the servo overshoots by a share of it.
  Eigen::MatrixXd free_matrix;
  Eigen::VectorXd free_velocity;
  Eigen::LLT<Eigen::MatrixXd> free_factor;
  Eigen::MatrixXd goal_J{kMostFunctionRows, 12};
  Eigen::VectorXd goal_r{kMostFunctionRows};
  Eigen::VectorXd goal_row;
  double most_speed = 0;  ///< That a goal may ask for, m/s or rad/s.
  VelocityFlags flags;
};

}  // namespace tether::control
