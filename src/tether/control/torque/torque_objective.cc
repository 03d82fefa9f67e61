#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "tether/control/torque/constrained_torque_impl.h"
#include "tether/control/torque/singularity.h"

namespace tether::control {
namespace {

using math::Matrix6d;
using math::Vector6d;

// A servo that brakes the hand may press with so much more for each m/s of its speed, Ns/m.
constexpr double kBrakeForce = 400;
// Moments count as forces at this lever, m.
constexpr double kLever = 0.2;
// Where the arm is as good as singular, redundancy leads away with up to this acceleration, rad/s².
constexpr double kSingularPush = 6;
// Functions of a goal come to zero with no more deceleration than this, m/s² and rad/s²: what the rows need
// meanwhile is left.
constexpr double kArrive = 1, kArriveTurning = 3;
// Backing off counts this much more than braking the joints, per kg.
constexpr double kBrakeWeight = 0.02;
constexpr double kRetreatRate = 40;      // 1/s
constexpr double kFastestRetreat = 0.2;  // m/s
constexpr double kUnexplained = 0.3;     // of the torques' square
constexpr double kHoldRate = 40;         // 1/s
constexpr double kFollowRate = 60;       // of velocities, 1/s

// The speed at which a distance is brought to zero: as e^(−kt) near it, with `braking` before.
double ArrivalSpeed(double distance, double k, double braking) {
  const double near = braking / (k * k);
  return distance <= near ? k * distance : std::sqrt(2 * braking * (distance - 0.5 * near));
}

}  // namespace

// How much of the hand's acceleration `a` may be asked for, so that a hand that is held presses with no more
// than `max_force`.
double ConstrainedTorque::Impl::PressedShare(const Vector6d& a, const Vector6d& V_BH, double max_force) {
  const double L = options.rotation_weight;
  Vector6d scale;
  scale << 1, 1, 1, L, L, L;
  MinvJt.noalias() = Minv * J.transpose();
  Matrix6d mobility;
  mobility.noalias() = J * MinvJt;
  mobility = (scale.asDiagonal() * mobility * scale.asDiagonal()).eval();
  mobility.diagonal().array() += options.null_weight;
  const Vector6d force = scale.asDiagonal() * mobility.llt().solve(Vector6d(scale.asDiagonal() * a));
  const double pressed = std::max(force.head<3>().norm(), force.tail<3>().norm() / kLever);
  const double braking = -force.dot(V_BH) / std::max(pressed, 1e-9);
  const double most = max_force + kBrakeForce * std::max(0.0, braking);
  if (pressed <= most) return 1;
  flags.force_limit = true;
  return most / pressed;
}

void ConstrainedTorque::Impl::AddHand(const HandTarget& target, double max_force) {
  const Vector6d V_BH = J * v;
  // What the servo would press with, beside what moves the arm's own mass along its reference.
  Vector6d a = DesiredHandAcceleration(options.gains, kinematics.X_BH(), V_BH, target) - target.A_BH;
  a *= PressedShare(a, V_BH, max_force);
  a += target.A_BH;
  Vector6d bias;
  bias << motion.PointBias(n, kinematics.X_BH().p), motion.AngularBias(n);
  const double L = options.rotation_weight;
  Vector6d weights;
  weights << 1, 1, 1, L * L, L * L, L * L;
  weighted_J = 2 * weights.asDiagonal() * J;
  H.noalias() += J.transpose() * weighted_J;
  g.noalias() -= weighted_J.transpose() * (a - bias);
}

void ConstrainedTorque::Impl::AddGoal(const Goal& goal, double max_force) {
  Frame frame = goal.frame;
  if (frame.object == kHeld) frame.object = bodies.held() < 0 ? -1 : bodies.held();
  const double rate = options.gains.position_damping, approach = options.gains.position / rate;
  for (const constraints::PoseFunctionPtr& function : goal.functions) {
    Evaluate(*function, goal.target, frame, function_rows);
    const int size = function->size();
    const bool metres = function->unit() == nlp::Unit::kMetre;
    const double norm = function_rows.r.head(size).norm();
    double& error = metres ? error_m : error_rad;
    error = std::max(error, norm);
    const double limit = metres ? goal.speed : goal.turn_speed;
    const double speed = std::min(ArrivalSpeed(norm, approach, metres ? kArrive : kArriveTurning), limit);
    const double weight = metres ? 1 : options.rotation_weight;
    for (int r = 0; r < size; ++r) {
      const double wanted_rate = norm > 0 ? -speed * function_rows.r[r] / norm : 0;
      double a = rate * (wanted_rate - function_rows.rate[r]);
      // Mass of this row: what a force along it accelerates.
      goal_row = function_rows.A.row(r).transpose();
      work.noalias() = Minv * goal_row;
      const double lever = metres ? 1 : kLever;
      const double mass = 1 / (goal_row.dot(work) + options.null_weight / (lever * lever));
      const double most = max_force * lever / mass;
      if (std::abs(a) > most && a * function_rows.rate[r] >= 0) {
        a = std::copysign(most, a);
        flags.force_limit = true;
      }
      H.noalias() += 2 * weight * weight * goal_row * goal_row.transpose();
      g -= 2 * weight * weight * (a - function_rows.bias[r]) * goal_row;
    }
  }
  if (goal.posture.size() != n) return;
  const double furthest = (kinematics.q() - goal.posture).cwiseAbs().maxCoeff();
  const double share = std::min(approach, goal.turn_speed / std::max(furthest, 1e-9));
  const double weight = 2 * options.rotation_weight * options.rotation_weight;
  for (int i = 0; i < n; ++i) {
    const double a = rate * (share * (goal.posture[i] - kinematics.q()[i]) - v[i]);
    H(i, i) += weight;
    g[i] -= weight * a;
  }
  error_rad = std::max(error_rad, furthest);
}

// The part of the posture in the hand's null space follows from the weight M: what is left of it does not
// move the hand (dynamic consistency).
void ConstrainedTorque::Impl::AddPosture(const Eigen::VectorXd* posture) {
  const OperationalSpaceGains& gains = options.gains;
  wanted = -gains.posture_damping * v;
  if (posture != nullptr) wanted += gains.posture * (*posture - kinematics.q());
  for (int i = 0; i < n; ++i) {
    const double range = model->upper()[i] - model->lower()[i];
    const double margin = std::min(gains.limit_margin, 0.25 * range);
    const double below = std::clamp(1 - (kinematics.q()[i] - model->lower()[i]) / margin, 0.0, 1.5);
    const double above = std::clamp(1 - (model->upper()[i] - kinematics.q()[i]) / margin, 0.0, 1.5);
    wanted[i] += gains.limit_push * (below * below - above * above);
  }
  AvoidSingularity();
  const double weight = 2 * options.null_weight;
  H.noalias() += weight * M;
  g.noalias() -= weight * (M * wanted);
}

void ConstrainedTorque::Impl::AddVelocities(const Eigen::VectorXd& velocities, double max_force) {
  wanted = kFollowRate * (velocities - v);
  const Vector6d a = J * wanted, V_BH = J * v;
  wanted *= PressedShare(a, V_BH, max_force);
  H.noalias() += 2 * M;
  g.noalias() -= 2 * (M * wanted);
}

void ConstrainedTorque::Impl::AddJoints(const JointTarget& joints) {
  FollowJoints(options.gains, kinematics.q(), v, joints, &wanted);
  const double weight = 2 * options.null_weight;
  H.noalias() += weight * M;
  g.noalias() -= weight * (M * wanted);
}

void ConstrainedTorque::Impl::AvoidSingularity() {
  const Dexterity dexterity = FindDexterity(kinematics, J, options.rotation_weight, kSingular);
  if (dexterity.least >= kSingular) return;
  flags.singular = true;
  const double depth = 1 - dexterity.least / kSingular;
  const double norm = dexterity.gradient.head(n).norm();
  if (norm > 0) wanted += kSingularPush * depth / norm * dexterity.gradient.head(n);
}

// `against`: accelerations that are there whatever the torques are, and are made up for; null: none.
void ConstrainedTorque::Impl::AddBrake(double weight, double rate, const Eigen::VectorXd* against) {
  wanted = -rate * v;
  if (against != nullptr) wanted -= *against;
  H.noalias() += 2 * weight * M;
  g.noalias() -= 2 * weight * (M * wanted);
}

void ConstrainedTorque::Impl::AddRetreat() {
  const Contact& contact = watch.contact();
  const double speed =
      std::min(kFastestRetreat, options.contact.retreat + options.contact.yield * contact.force);
  goal_row = watch.slope();
  // A push somewhere on the arm, which no force on the hand explains, has no normal to back off along: the
  // arm holds against it.
  const double felt = watch.felt().squaredNorm(), length = goal_row.squaredNorm();
  const double explained = length > 0 ? std::pow(goal_row.dot(watch.felt()), 2) / length : 0;
  if (watch.candidate() < 0 && felt - explained > kUnexplained * felt) return AddBrake(1, kHoldRate, &thrown);
  double rate = goal_row.dot(v), bias = 0;
  if (watch.candidate() >= 0) {
    const Row& row = rows[static_cast<size_t>(candidates[static_cast<size_t>(watch.candidate())].row)];
    rate = row.rate;
    bias = row.bias;
  }
  const double a = kRetreatRate * (speed - rate);
  H.noalias() += 2 * goal_row * goal_row.transpose();
  g -= 2 * (a - bias) * goal_row;
  // Along its normal the arm gives way to the force; what else it does to the joints is made up for.
  work.noalias() = Minv * goal_row;
  const double mobility = goal_row.dot(work);
  across = thrown;
  if (mobility > 0) across -= goal_row.dot(thrown) / mobility * work;
  AddBrake(kBrakeWeight, options.brake_rate, &across);
}

}  // namespace tether::control
