#include "tether/control/operational_space.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "tether/common/document/option_check.h"
#include "tether/common/document/value.h"
#include "tether/common/error.h"
#include "tether/math/pose_error.h"

namespace tether::control {
namespace {

using math::Matrix6d;
using math::Vector6d;

// Makes rotational and linear mobilities comparable: the arm's effect on a point this far from the grasp
// point, m.
constexpr double kCharacteristicLength = 0.2;
// Directions whose mobility (1/kg, at the characteristic length) is below this are damped: an effective mass
// of 25 kg.
constexpr double kSmallMobility = 0.02;
// Braking before a position limit keeps within this deceleration, rad/s², and ends this far from the limit,
// rad.
constexpr double kBrake = 10;
constexpr double kLimitGap = 0.02;
// Joints are braked from this share of the velocity limit on.
constexpr double kVelocityShare = 0.85;
// Rate at which a joint's excess velocity is removed, 1/s; a fifth of the control rate at most.
constexpr double kBrakeRate = 200;

Eigen::Vector3d Saturated(const Eigen::Vector3d& v, double max) {
  const double norm = v.norm();
  return norm > max ? Eigen::Vector3d(v * (max / norm)) : v;
}

}  // namespace

void OperationalSpaceGains::Validate() const {
  Diagnostics diagnostics;
  const OptionCheck check("the operational-space controller", &diagnostics);
  check.Positive("position", position);
  check.Positive("position_damping", position_damping);
  check.Positive("rotation", rotation);
  check.Positive("rotation_damping", rotation_damping);
  check.NotNegative("posture", posture);
  check.NotNegative("posture_damping", posture_damping);
  check.NotNegative("obstacle_damping", obstacle_damping);
  check.Positive("limit_margin", limit_margin);
  check.NotNegative("limit_push", limit_push);
  check.Positive("max_position_error", max_position_error);
  check.Positive("max_rotation_error", max_rotation_error);
  diagnostics.ThrowIfAny();
}

bool IsFinite(const HandTarget& target) {
  return target.X_BH.p.allFinite() && target.X_BH.R.allFinite() && target.V_BH.allFinite() &&
         target.A_BH.allFinite() && target.F_BH.allFinite() && target.toward_obstacle.allFinite() &&
         std::isfinite(target.obstacle_weight);
}

Vector6d DesiredHandAcceleration(const OperationalSpaceGains& gains, const math::Pose& X_BH,
                                 const Vector6d& V_BH, const HandTarget& target) {
  const Vector6d error = math::PoseError(X_BH, target.X_BH);
  const Eigen::Vector3d position_error = Saturated(error.head<3>(), gains.max_position_error);
  const Eigen::Vector3d rotation_error = Saturated(error.tail<3>(), gains.max_rotation_error);
  Vector6d a = target.A_BH;
  a.head<3>() +=
      gains.position * position_error + gains.position_damping * (target.V_BH.head<3>() - V_BH.head<3>());
  a.tail<3>() +=
      gains.rotation * rotation_error + gains.rotation_damping * (target.V_BH.tail<3>() - V_BH.tail<3>());
  const double approach = V_BH.head<3>().dot(target.toward_obstacle);
  if (approach > 0) {
    a.head<3>() -= gains.obstacle_damping * target.obstacle_weight * approach * target.toward_obstacle;
  }
  return a;
}

void FollowJoints(const OperationalSpaceGains& gains, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                  const JointTarget& target, Eigen::VectorXd* acceleration) {
  *acceleration = target.a + gains.position * (target.q - q) + gains.position_damping * (target.v - v);
}

struct OperationalSpaceController::Workspace {
  std::shared_ptr<const robot::Model> model;
  OperationalSpaceGains gains;
  Eigen::VectorXd posture;
  ControlFlags flags;
  Eigen::VectorXd torque, bias, task, null, brake, excess;
  Eigen::LLT<Eigen::MatrixXd> M_llt;
  Eigen::Matrix<double, Eigen::Dynamic, 6> MinvJt;  // n × 6
  Eigen::SelfAdjointEigenSolver<Matrix6d> eigen;
  Matrix6d mobility, lambda;

  explicit Workspace(int n)
      : torque(Eigen::VectorXd::Zero(n)),
        bias(Eigen::VectorXd::Zero(n)),
        task(Eigen::VectorXd::Zero(n)),
        null(Eigen::VectorXd::Zero(n)),
        brake(Eigen::VectorXd::Zero(n)),
        excess(Eigen::VectorXd::Zero(n)),
        M_llt(n),
        MinvJt(n, 6) {}

  const Eigen::VectorXd& Fault(const robot::State& state);
  void ComputeLambda(const robot::State& state);
  void ComputePosture(const robot::State& state, const JointTarget* joints);
  void ComputeBrakes(const robot::State& state);
  void Limit();
};

OperationalSpaceController::OperationalSpaceController(std::shared_ptr<const robot::Model> model,
                                                       const OperationalSpaceGains& gains,
                                                       const Eigen::VectorXd& posture)
    : work_(std::make_unique<Workspace>(model->dof())) {
  gains.Validate();
  assert(posture.size() == model->dof());
  work_->model = std::move(model);
  work_->gains = gains;
  work_->posture = posture;
}

OperationalSpaceController::~OperationalSpaceController() = default;
OperationalSpaceController::OperationalSpaceController(OperationalSpaceController&&) noexcept = default;
OperationalSpaceController& OperationalSpaceController::operator=(OperationalSpaceController&&) noexcept =
    default;

const ControlFlags& OperationalSpaceController::flags() const { return work_->flags; }
const Eigen::VectorXd& OperationalSpaceController::posture() const { return work_->posture; }

void OperationalSpaceController::set_posture(const Eigen::VectorXd& posture) {
  assert(posture.size() == work_->posture.size());
  work_->posture = posture;
}

const Eigen::VectorXd& OperationalSpaceController::Compute(const robot::State& state,
                                                           const HandTarget& target,
                                                           const JointTarget* joints) {
  Workspace& w = *work_;
  w.flags = {};
  const bool state_finite = state.q().allFinite() && state.v().allFinite() && state.bias().allFinite() &&
                            state.J_BH().allFinite() && state.M().allFinite() && state.X_BH().p.allFinite() &&
                            state.X_BH().R.allFinite();
  if (!IsFinite(target) || !state_finite) return w.Fault(state);
  w.bias = state.bias();

  w.M_llt.compute(state.M());
  if (w.M_llt.info() != Eigen::Success) return w.Fault(state);
  w.ComputeLambda(state);
  const Vector6d acceleration =
      DesiredHandAcceleration(w.gains, state.X_BH(), state.J_BH() * state.v(), target);
  const Vector6d force = w.lambda * acceleration + target.F_BH;
  w.task.noalias() = state.J_BH().transpose() * force;

  w.ComputePosture(state, joints);
  // All joints are told where to be: no need of the hand's inverse, which is lost near singularities.
  if (joints != nullptr) w.task.noalias() = state.J_BH().transpose() * target.F_BH;
  // Dynamically consistent projection: what is left of the posture torque accelerates the joints but not the
  // hand.
  if (joints == nullptr) {
    const Vector6d hand_acceleration = w.MinvJt.transpose() * w.null;
    const Vector6d hand_force = w.lambda * hand_acceleration;
    w.null.noalias() -= state.J_BH().transpose() * hand_force;
  }
  w.task += w.null;

  w.ComputeBrakes(state);
  w.task += w.brake;
  w.Limit();
  if (!w.torque.allFinite()) return w.Fault(state);
  return w.torque;
}

// Compensates the last known gravity and, where velocities are known, brakes.
const Eigen::VectorXd& OperationalSpaceController::Workspace::Fault(const robot::State& state) {
  flags.fault = true;
  if (state.bias().allFinite()) bias = state.bias();
  task.setZero();
  if (state.v().allFinite()) {
    const double rate = gains.posture_damping;
    if (state.M().allFinite()) {
      task = -rate * state.M().diagonal().cwiseProduct(state.v());
    } else {
      task = -rate * state.v();
    }
  }
  Limit();
  return torque;
}

void OperationalSpaceController::Workspace::ComputeLambda(const robot::State& state) {
  MinvJt = state.J_BH().transpose();
  M_llt.solveInPlace(MinvJt);
  Vector6d scale;
  scale << 1, 1, 1, kCharacteristicLength, kCharacteristicLength, kCharacteristicLength;
  mobility.noalias() = state.J_BH() * MinvJt;
  mobility = scale.asDiagonal() * mobility * scale.asDiagonal();
  mobility = 0.5 * (mobility + mobility.transpose()).eval();
  eigen.compute(mobility);
  Vector6d inverse;
  for (int i = 0; i < 6; ++i) {
    const double value = std::max(0.0, eigen.eigenvalues()[i]);
    // Smooth at the threshold, at most 1/(2 d) anywhere and zero where the arm cannot move at all.
    double damping = 0;
    if (value < kSmallMobility) {
      flags.singular = true;
      const double depth = 1 - value / kSmallMobility;
      damping = 0.5 * kSmallMobility * depth;
    }
    const double denominator = value * value + damping * damping;
    inverse[i] = denominator > 0 ? value / denominator : 0;
  }
  lambda = eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
  lambda = scale.asDiagonal() * lambda * scale.asDiagonal();
}

void OperationalSpaceController::Workspace::ComputePosture(const robot::State& state,
                                                           const JointTarget* joints) {
  // `brake` is unused here and holds the joint accelerations.
  Eigen::VectorXd& acceleration = brake;
  if (joints != nullptr) {
    FollowJoints(gains, state.q(), state.v(), *joints, &acceleration);
    null.noalias() = state.M() * acceleration;
    return;
  }
  acceleration = gains.posture * (posture - state.q()) - gains.posture_damping * state.v();
  for (int i = 0; i < acceleration.size(); ++i) {
    const double margin = std::min(gains.limit_margin, 0.25 * (model->upper()[i] - model->lower()[i]));
    const double below = std::clamp(1 - (state.q()[i] - model->lower()[i]) / margin, 0.0, 1.5);
    const double above = std::clamp(1 - (model->upper()[i] - state.q()[i]) / margin, 0.0, 1.5);
    acceleration[i] += gains.limit_push * (below * below - above * above);
  }
  null.noalias() = state.M() * acceleration;
}

// Each joint may run towards a limit only as fast as it can brake before it.
void OperationalSpaceController::Workspace::ComputeBrakes(const robot::State& state) {
  for (int i = 0; i < brake.size(); ++i) {
    const double q = state.q()[i];
    const double v = state.v()[i];
    const double cap = kVelocityShare * model->max_velocity()[i];
    const auto allowed = [&](double room) {
      return room > 0 ? std::min(cap, std::sqrt(2 * kBrake * room)) : std::max(-cap, 4 * room);
    };
    const double up = allowed(model->upper()[i] - kLimitGap - q);
    const double down = -allowed(q - model->lower()[i] - kLimitGap);
    excess[i] = v > up ? up - v : v < down ? down - v : 0;
    if (excess[i] != 0) flags.joint_limit = true;
  }
  brake.setZero();
  if (!flags.joint_limit) return;
  brake.noalias() = kBrakeRate * (state.M() * excess);
  // The task's acceleration towards the limit is removed.
  for (int i = 0; i < brake.size(); ++i) {
    if (task[i] * excess[i] < 0) brake[i] -= task[i];
  }
}

void OperationalSpaceController::Workspace::Limit() {
  double scale = 1;
  for (int i = 0; i < task.size(); ++i) {
    const double max = model->max_torque()[i];
    const double held = std::clamp(bias[i], -max, max);
    const double room = task[i] > 0 ? max - held : max + held;
    if (std::abs(task[i]) > room) scale = std::min(scale, room / std::abs(task[i]));
  }
  flags.torque_limit = scale < 1;
  for (int i = 0; i < task.size(); ++i) {
    const double max = model->max_torque()[i];
    torque[i] = std::clamp(bias[i] + scale * task[i], -max, max);
  }
}

}  // namespace tether::control
