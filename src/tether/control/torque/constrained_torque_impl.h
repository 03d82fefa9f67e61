#pragma once

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

#include "tether/control/constrained_arm.h"
#include "tether/control/pair_bounds.h"
#include "tether/control/torque/constrained_torque.h"
#include "tether/control/torque/joint_braking.h"
#include "tether/control/torque/link_motion.h"

namespace tether::control {

/// The rows of a function of frames (target, frame) along the arm's motion: r, ṙ, and r̈ = A q̈ + bias.
struct FunctionRows {
  Eigen::VectorXd r{kMostFunctionRows}, rate{kMostFunctionRows}, bias{kMostFunctionRows};
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> A;
  Eigen::MatrixXd J, J_after, J_before;
  Eigen::VectorXd unused;
};

struct ConstrainedTorque::Impl : ConstrainedArm<ConstrainedTorque::Row> {
  /// A frame with its twist, and the twist's derivative without q̈, all in the frame itself.
  struct MovingFrame {
    math::Pose X_BF;
    math::Vector6d V = math::Vector6d::Zero();
    math::Vector6d A = math::Vector6d::Zero();
  };

  Impl(std::shared_ptr<const robot::Model> model_in, const math::Pose& X_WBase_in,
       const std::vector<Solid>& objects, const std::vector<ClearanceConstraint>& clearances,
       std::vector<FieldConstraint> fields_in, const TorqueOptions& options_in);

  // torque_rows.cc
  void SetRoom();
  void AddPairRows();
  void MoveBodies();
  void AddFieldRows(const FieldConstraint& field, int constraint);
  MovingFrame FrameNow(const Frame& frame, bool target) const;
  void Evaluate(const constraints::PoseFunction& function, const Frame& target, const Frame& frame,
                FunctionRows& out) const;
  /// What a row's second derivative must not be below: near its limit …
  double NeededNear(double value, double rate) const;
  /// … and so that it can be braked before; −`most` if that holds in any case. `slope`: its derivative in q.
  double NeededToStop(const Row& row, const double* slope, double most) const;

  // torque_objective.cc
  void AddHand(const HandTarget& target, double max_force);
  void AddJoints(const JointTarget& joints);
  void AddGoal(const Goal& goal, double max_force);
  void AddVelocities(const Eigen::VectorXd& velocities, double max_force);
  double PressedShare(const math::Vector6d& a, const math::Vector6d& V_BH, double max_force);
  void AddPosture(const Eigen::VectorXd* posture);
  void AvoidSingularity();
  void AddBrake(double weight, double rate, const Eigen::VectorXd* against = nullptr);
  void AddRetreat();

  // torque_solve.cc
  void SetTorqueBox();
  void SetJointBounds();
  void ChooseRows();
  void Solve();
  void SolveConflict();
  void Brake();
  void Report();

  // constrained_torque.cc
  bool TakeInput(const TorqueInput& input, const TorqueTask& task);
  void WatchContact(const TorqueInput& input, const TorqueTask& task);
  void AddObjective(const TorqueTask& task);
  void Fault(const TorqueInput& input);

  TorqueOptions options;
  LinkMotion motion;
  BrakingReserve reserve;
  ContactWatch watch;
  LoadEstimator load;
  PairBounds pair_bounds;

  bool task_finite = true;
  std::vector<ContactCandidate> candidates;
  int num_candidates = 0;
  std::vector<int> chosen;    ///< Rows in the QP …
  std::vector<double> sides;  ///< … and what A q̈ must not be below there.
  int num_chosen = 0;

  // Of this tick.
  Eigen::VectorXd v, carried, hold;  ///< Joint velocities; JᵀF of the payload; h + carried.
  Eigen::MatrixXd M, Minv, J, weighted_J, MinvJt;
  Eigen::LLT<Eigen::MatrixXd> M_llt;
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  Eigen::VectorXd tau_lower, tau_upper;  ///< Torque and torque rate, Nm.
  Eigen::VectorXd middle, half;          ///< q̈ in the middle of that box; half of the box, Nm.
  Eigen::VectorXd velocity_lower, velocity_upper, position_lower, position_upper;
  Eigen::VectorXd smooth_lower, smooth_upper;  ///< Acceleration and jerk.
  Eigen::VectorXd lower, upper;                ///< All of these.
  Eigen::VectorXd work, unexplained;
  Eigen::VectorXd thrown;  ///< Joint accelerations by what pushes the arm, rad/s² …
  Eigen::VectorXd across;  ///< … without those along a contact's normal.

  FunctionRows function_rows;
  Eigen::VectorXd wanted, goal_row;

  bool started = false;
  Eigen::VectorXd qddot, torque;
  TorqueFlags flags;
};

}  // namespace tether::control
