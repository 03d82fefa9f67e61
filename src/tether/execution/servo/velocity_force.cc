#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "tether/common/text.h"
#include "tether/control/objective.h"
#include "tether/execution/servo/velocity_servo.h"
#include "tether/robot/gravity.h"

namespace tether::execution {
namespace {

using Eigen::Vector3d;
using math::Pose;

// A force must be there for so long, s; then the hand backs off at this speed, m/s, for so long, s.
constexpr double kFor = 0.004, kBackOffSpeed = 0.05, kBackOffFor = 0.3;
// How far ahead of the hand its goal is meanwhile, m.
constexpr double kAhead = 0.1;
constexpr double kRegular = 1e-4;
// What is held may weigh so much more than it was said to, N, and accelerate by so much, m/s².
constexpr double kHeavier = 5, kAccelerates = 2;

}  // namespace

// A robot that is told velocities presses with all that it has. The force on the hand that explains the
// external torques best must not be more than the step may press with.
void VelocityServo::WatchForce() {
  if (drive_ || s_.tau_external.size() != s_.model->dof() || !s_.tau_external.allFinite()) return;
  kinematics_.Set(s_.q);
  kinematics_.HandJacobian(J_BH_);
  Eigen::Matrix3d JJt = J_BH_.topRows<3>() * J_BH_.topRows<3>().transpose();
  JJt.diagonal().array() += kRegular;
  Vector3d force_B = JJt.ldlt().solve(Vector3d(J_BH_.topRows<3>() * s_.tau_external));
  double most = s_.in_plan() ? s_.plan_step().max_force.value_or(options_.max_force) : options_.max_force;
  if (s_.held.valid()) {
    const double mass = s_.object(s_.held).mass.value_or(0);
    force_B += s_.X_WB.R.transpose() * Vector3d(0, 0, mass * robot::kGravity);
    most += kHeavier + kAccelerates * mass;
  }
  const double force = force_B.norm();
  if (force <= most) {
    pressed_since_ = -1;
    return;
  }
  if (pressed_since_ < 0) pressed_since_ = s_.time;
  if (s_.time - pressed_since_ < kFor) return;
  if (s_.time > backs_off_until_) {
    s_.Record(EventKind::kSafety,
              "the hand presses with about " + Fixed(force, 0) + " N, more than is allowed; it backs off");
    Pose X_BH = kinematics_.X_BH();
    X_BH.p += kAhead / force * force_B;
    back_off_.functions = control::MakeObjective(control::Objective::kPose, X_BH);
    back_off_.speed = kBackOffSpeed;
    back_off_.turn_speed = options_.turn_speed;
  }
  backs_off_until_ = s_.time + kBackOffFor;
}

}  // namespace tether::execution
