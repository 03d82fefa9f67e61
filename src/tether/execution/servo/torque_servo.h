#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tether/common/error.h"
#include "tether/common/id.h"
#include "tether/control/constraint_spec.h"
#include "tether/control/torque/constrained_torque.h"
#include "tether/control/torque/torque_limiter.h"
#include "tether/execution/contact/touch.h"
#include "tether/execution/sequencer/constraint_builder.h"
#include "tether/execution/servo/situation.h"
#include "tether/robot/interface.h"
#include "tether/scene/scene.h"

namespace tether::execution {

struct TorqueServoOptions {
  control::TorqueOptions controller;
  /// A scenario's. Without a `clearance` among them, links, hand and what is held keep clear of everything
  /// that no step intends to touch.
  std::vector<control::ConstraintSpec> constraints;
  double max_force = 40;          ///< That the arm presses with, N.
  Location max_force_where = {};  ///< Where a file says so.
};

/// The constraints that a torque run has: the scenario's, and where it has no `clearance`, that of links,
/// hand and held object at 0 m from all objects of the scene.
std::vector<control::ConstraintSpec> TorqueConstraints(std::vector<control::ConstraintSpec> given,
                                                       const scene::Scene& scene);

/// What is measured, and what is to be done in a tick.
struct TorqueServoTick {
  const robot::State& state;
  double opening = 0;                                           ///< m
  const IndexedVector<ObjectId, control::MovingPose>& objects;  ///< In the world.
  const Eigen::VectorXd& tau_external;                          ///< n, Nm
  const control::HandTarget& target;
  const Eigen::VectorXd& posture;                ///< n, rad
  ObjectId held;                                 ///< In the hand; not valid: nothing is.
  const TouchList& allowed;                      ///< Pairs that the step may bring into contact.
  double max_force = 40;                         ///< N
  const control::JointTarget* joints = nullptr;  ///< A path of the whole arm that is followed.
  bool brake = false;                            ///< In place of all that.
};

/// From where the hand should be to torques: the constrained controller with the limiter behind it, bound to
/// a scene. Compute() allocates nothing.
class TorqueServo {
 public:
  TorqueServo(const scene::Scene& scene, const std::string& robot, std::shared_ptr<const robot::Model> model,
              const TorqueServoOptions& options);

  const Eigen::VectorXd& Compute(const TorqueServoTick& tick);

  /// The force and moment at the hand's origin that hold what it carries, base frame, N and Nm: told from the
  /// external torques.
  math::Vector6d Holding(const math::Pose& X_BH) const { return controller_.load().Holding(X_BH); }
  /// kg; 0 while it is not known to a tenth, or to 50 g.
  double HeldMass() const;
  /// The torques that hold what the hand carries, as of the last tick, n, Nm.
  const Eigen::VectorXd& carried() const { return carried_; }
  const control::TorqueFlags& flags() const { return controller_.flags(); }
  const control::LimiterFlags& limiter_flags() const { return limiter_.flags(); }
  const control::ConstrainedTorque& controller() const { return controller_; }
  /// "the hand presses on 'bench' with 14 N", of the contact that began in this tick; else empty.
  std::string DescribeContact() const;
  /// What kept the arm from accelerating in the last tick: "the hand near 'bench'", up to three, joined by
  /// commas; empty: no constraint did.
  std::string DescribeBinding() const;

 private:
  control::ConstrainedTorque Make(const TorqueServoOptions& options);
  std::string NameOf(int body) const;

  std::shared_ptr<const robot::Model> model_;
  ControlScene scene_;
  control::ConstrainedTorque controller_;
  control::TorqueLimiter limiter_;
  TouchList allowed_;
  std::vector<std::pair<int, int>> allowed_bodies_;
  ObjectId held_;
  Eigen::VectorXd carried_;
};

/// Follows with torques what the velocity controller makes of an objective: the constrained controller with
/// the limiter behind it. Compute() allocates nothing.
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

  /// Torques that lead to these joint velocities (n, rad/s; null: the arm stays where it is) and press with
  /// no more than `max_force`, N.
  const Eigen::VectorXd& Compute(const Situation& situation, const Eigen::VectorXd* velocities,
                                 double max_force);
  const control::ConstrainedTorque& controller() const { return controller_; }
  const Eigen::VectorXd& carried() const { return carried_; }

 private:
  robot::State state_;
  control::ConstrainedTorque controller_;
  control::TorqueLimiter limiter_;
  control::Goal stay_;
  bool stays_ = false;
  Eigen::VectorXd carried_;
};

}  // namespace tether::execution
