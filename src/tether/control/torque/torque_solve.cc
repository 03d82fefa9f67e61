#include <algorithm>
#include <cmath>
#include <span>

#include "tether/control/torque/constrained_torque_impl.h"

namespace tether::control {
namespace {

// A lone row is asked for this share of what the torques can give in a tick, so that it can be had.
constexpr double kWithin = 0.98;
// A side of the torque box is reached to this, Nm; a bound on a joint to this, rad/s².
constexpr double kReached = 1e-6;
// A row that is violated by less holds, m/s² or rad/s².
constexpr double kNothing = 1e-3;
// What is violated by less is at its limit, m or rad.
constexpr double kRounding = 5e-4;
// Too high a speed is taken back with up to so many times the acceleration that a joint is to have.
constexpr double kHarder = 4;
// A row is at its bound within this, m/s² or rad/s².
constexpr double kBinding = 1e-6;
// No joint accelerates more, rad/s²: keeps the conflict's problem bounded.
constexpr double kFarAway = 1e5;

}  // namespace

void ConstrainedTorque::Impl::SetTorqueBox() {
  if (!started) {
    torque = hold.cwiseMax(-model->max_torque()).cwiseMin(model->max_torque());
    qddot.setZero();
    started = true;
  }
  const double dt = options.period * options.rate_margin;
  tau_lower = (torque - dt * model->max_torque_rate()).cwiseMax(-model->max_torque());
  tau_upper = (torque + dt * model->max_torque_rate()).cwiseMin(model->max_torque());
  half = 0.5 * (tau_upper - tau_lower);
  work = 0.5 * (tau_upper + tau_lower) - hold;
  middle.noalias() = Minv * work;
}

void ConstrainedTorque::Impl::SetJointBounds() {
  const double dt = options.period;
  reserve.Set(M, hold, options.torque_share, options.rate_share);
  // What pushes the arm towards a limit adds to its accelerations: the bounds are on their sum.
  thrown.noalias() = Minv * watch.felt();
  for (int i = 0; i < n; ++i) {
    const double q = kinematics.q()[i];
    const double hardest = model->max_acceleration()[i];
    const Braking braking = reserve.of(i);
    const double fastest = options.velocity_share * model->max_velocity()[i];
    const double up = std::max(0.0, thrown[i]), down = std::max(0.0, -thrown[i]);
    // ERRATA B2: the margin is measured from the limits, whatever their sign, and never beyond the middle.
    const double range = model->upper()[i] - model->lower()[i];
    const double margin = std::min(options.joint_margin + options.limit_gap, 0.45 * range);
    const double above = model->upper()[i] - margin - q, below = q - model->lower()[i] - margin;
    position_upper[i] =
        MostAccelerationToStop(above, v[i], hardest, hardest, options.return_speed, dt, braking);
    position_lower[i] =
        -MostAccelerationToStop(below, -v[i], hardest, hardest, options.return_speed, dt, braking);
    if (position_upper[i] < hardest) position_upper[i] -= up;
    if (position_lower[i] > -hardest) position_lower[i] += down;
    // What a limit needs may be harder than a motion is wanted to be.
    const double keep_up = MostAccelerationToKeepSpeed(fastest - v[i], kHarder * hardest, dt, braking) - up;
    const double keep_down =
        MostAccelerationToKeepSpeed(fastest + v[i], kHarder * hardest, dt, braking) - down;
    velocity_upper[i] = std::min(keep_up, std::max({hardest, -keep_down, position_lower[i]}));
    velocity_lower[i] = -std::min(keep_down, std::max({hardest, -keep_up, -position_upper[i]}));
    // To hold against it is no acceleration: the other bound has so much more room.
    position_upper[i] += down;
    position_lower[i] -= up;
    velocity_upper[i] += down;
    velocity_lower[i] -= up;
    // No more is asked for than the joint's own torque can do: else all the others are thrown about for it.
    const double own = kWithin * Minv(i, i) * half[i];
    for (Eigen::VectorXd* bound : {&velocity_upper, &position_upper})
      (*bound)[i] = std::max((*bound)[i], middle[i] - own);
    for (Eigen::VectorXd* bound : {&velocity_lower, &position_lower})
      (*bound)[i] = std::min((*bound)[i], middle[i] + own);
    flags.outside = flags.outside || model->upper()[i] < q || q < model->lower()[i];
    lower[i] = std::max(velocity_lower[i], position_lower[i]);
    upper[i] = std::min(velocity_upper[i], position_upper[i]);
    // Velocity goes before position.
    if (lower[i] > upper[i]) {
      const double kept = std::clamp(0.5 * (position_lower[i] + position_upper[i]), velocity_lower[i],
                                     std::max(velocity_lower[i], velocity_upper[i]));
      lower[i] = upper[i] = kept;
    }
    // Limits come before jerk: where the last acceleration is beyond them, all of the change is allowed.
    const double change = model->max_jerk()[i] * dt;
    smooth_lower[i] = std::max(-hardest - up, qddot[i] - change);
    smooth_upper[i] = std::min(hardest + down, qddot[i] + change);
    const double low = lower[i], high = upper[i];
    lower[i] = std::clamp(smooth_lower[i], low, high);
    upper[i] = std::clamp(smooth_upper[i], low, high);
  }
}

// Rows that hold whatever torques are chosen stay out of the QP; those that ask for more than any torques
// can give are asked for what these can. A M⁻¹ τ over the box has its ends in closed form.
void ConstrainedTorque::Impl::ChooseRows() {
  num_chosen = 0;
  for (int r = 0; r < num_rows; ++r) {
    Row& row = rows[static_cast<size_t>(r)];
    if (row.allowed) continue;
    const auto A = Jacobian(r);
    if (!std::isfinite(row.needed) || !std::isfinite(row.bias) || !A.allFinite()) {
      rows_finite = false;
      return;
    }
    work.noalias() = Minv * A.transpose();
    const double centre = A.dot(middle);
    const double spread = work.cwiseAbs().dot(half);
    // What pushes the arm counts, whichever way: what holds the arm against it is no motion.
    const double pushed = A.dot(thrown);
    const double least = centre - spread + row.bias + pushed;
    row.needed = std::min(std::max(row.needed, NeededToStop(row, A.data(), -least)), options.most_needed);
    const double side = row.needed - row.bias - pushed;
    if (side <= centre - spread) continue;
    // While there is room a row asks for no more than what all joints can give at once: to ask for all of the
    // torques would leave the other joints none.
    double change = kWithin * spread;
    if (row.value > 0) {
      double shared = 0, bounds = 0;
      for (int i = 0; i < n; ++i) {
        shared += std::abs(A[i]) * reserve.of(i).jerk;
        bounds += std::max(A[i] * lower[i], A[i] * upper[i]);
      }
      change = std::min({change, options.period * shared, kWithin * (bounds - centre)});
    }
    chosen[static_cast<size_t>(num_chosen)] = r;
    sides[static_cast<size_t>(num_chosen++)] = std::min(side, centre + change);
  }
}

void ConstrainedTorque::Impl::Solve() {
  problem->Resize(n, 0, n + num_chosen);
  problem->H() = H;
  problem->g() = g;
  problem->x_lower() = lower;
  problem->x_upper() = upper;
  auto A = problem->A();
  auto A_lower = problem->lower(), A_upper = problem->upper();
  A.topRows(n) = M;
  A_lower.head(n) = tau_lower - hold;
  A_upper.head(n) = tau_upper - hold;
  for (int i = 0; i < num_chosen; ++i) {
    A.row(n + i) = Jacobian(chosen[static_cast<size_t>(i)]);
    A_lower[n + i] = sides[static_cast<size_t>(i)];
  }
  const qp::Status status = solver->Solve(*problem);
  flags.iterations = solver->iterations();
  if (status == qp::Status::kInfeasible) return SolveConflict();
  if (status != qp::Status::kSolved || !solver->x().allFinite()) return Brake();
  qddot = solver->x();
}

void ConstrainedTorque::Impl::SolveConflict() {
  flags.conflict = true;
  const int first_velocity = n, first_position = 2 * n, first_row = 3 * n, first_smooth = 3 * n + num_chosen;
  const int all = first_smooth + n;
  conflict_problem->Resize(n, 0, all);
  conflict_problem->H() = H;
  conflict_problem->g() = g;
  conflict_problem->x_lower().setConstant(-kFarAway);
  conflict_problem->x_upper().setConstant(kFarAway);
  auto A = conflict_problem->A();
  auto A_lower = conflict_problem->lower(), A_upper = conflict_problem->upper();
  A.topRows(n) = M;
  A_lower.head(n) = tau_lower - hold;
  A_upper.head(n) = tau_upper - hold;
  int last = 4;
  for (int i = 0; i < num_chosen; ++i) {
    const auto r = static_cast<size_t>(i);
    const Row& row = rows[static_cast<size_t>(chosen[r])];
    A.row(first_row + i) = Jacobian(chosen[r]);
    A_lower[first_row + i] = sides[r];
    // The highest `relax` is relaxed first.
    levels[static_cast<size_t>(first_row + i)] = 3 + row.priority;
    last = std::max(last, 4 + row.priority);
  }
  const auto joints = [&](int first, int level, const Eigen::VectorXd& low, const Eigen::VectorXd& high) {
    A.middleRows(first, n).setIdentity();
    for (int i = 0; i < n; ++i) {
      A_lower[first + i] = std::min(low[i], high[i]);
      A_upper[first + i] = std::max(low[i], high[i]);
      levels[static_cast<size_t>(first + i)] = level;
    }
  };
  std::fill(levels.begin(), levels.begin() + n, 0);
  joints(first_velocity, 1, velocity_lower, velocity_upper);
  joints(first_position, 2, position_lower, position_upper);
  joints(first_smooth, last, smooth_lower, smooth_upper);
  // What the proof says of a joint's bound is said of any of the bounds that it is made of.
  int last_in_proof = 0;
  for (const qp::RowWeight& row : solver->conflict()) {
    if (row.kind == qp::RowKind::kBound)
      last_in_proof = last;
    else if (row.index >= n)
      last_in_proof = std::max(last_in_proof, levels[static_cast<size_t>(first_row + row.index - n)]);
  }
  const qp::Status status = conflict_solver->SolveConflict(
      *conflict_problem, std::span<const int>(levels.data(), static_cast<size_t>(all)), last_in_proof);
  flags.iterations += conflict_solver->iterations();
  if (status != qp::Status::kSolved || !conflict_solver->x().allFinite()) return Brake();
  qddot = conflict_solver->x();
  double largest = kNothing;
  for (int i = 0; i < num_chosen; ++i) {
    const double violation = conflict_solver->violations()[static_cast<size_t>(first_row + i)];
    if (violation <= largest) continue;
    largest = violation;
    flags.relaxed = true;
    flags.violation = violation;
    flags.worst = rows[static_cast<size_t>(chosen[static_cast<size_t>(i)])].constraint;
  }
}

void ConstrainedTorque::Impl::Brake() {
  flags.braking = true;
  for (int i = 0; i < n; ++i) {
    const double most = reserve.of(i).deceleration;
    qddot[i] = std::clamp(-options.brake_rate * v[i], -most, most);
    qddot[i] =
        std::max(std::min(qddot[i], velocity_upper[i]), std::min(velocity_lower[i], velocity_upper[i]));
  }
}

void ConstrainedTorque::Impl::Report() {
  for (int i = 0; i < n; ++i) {
    const bool at_rate = torque[i] <= tau_lower[i] + kReached || torque[i] >= tau_upper[i] - kReached;
    const bool at_limit = std::abs(torque[i]) >= model->max_torque()[i] - kReached;
    flags.torque_limit = flags.torque_limit || at_limit;
    flags.rate_limit = flags.rate_limit || (at_rate && !at_limit);
    const double up = std::min(velocity_upper[i], position_upper[i]);
    const double down = std::max(velocity_lower[i], position_lower[i]);
    const double hardest = model->max_acceleration()[i];
    flags.joint_limit = flags.joint_limit || (up < hardest && qddot[i] >= up - kReached) ||
                        (down > -hardest && qddot[i] <= down + kReached);
  }
  for (int i = 0; i < num_chosen; ++i) {
    const int r = chosen[static_cast<size_t>(i)];
    rows[static_cast<size_t>(r)].binding = Jacobian(r).dot(qddot) <= sides[static_cast<size_t>(i)] + kBinding;
  }
  for (int r = 0; r < num_rows; ++r) {
    const Row& row = rows[static_cast<size_t>(r)];
    const double depth = -(row.value + row.buffer);
    if (row.allowed || depth <= kRounding) continue;
    if (!flags.relaxed && (!flags.violated || depth > flags.violation)) {
      flags.worst = row.constraint;
      flags.violation = depth;
    }
    flags.violated = true;
  }
}

}  // namespace tether::control
