#include "tether/control/constrained_velocity.h"

#include <algorithm>
#include <cmath>

#include "tether/common/document/option_check.h"
#include "tether/common/error.h"
#include "tether/control/constrained_velocity_impl.h"

namespace tether::control {
namespace {

using math::Pose;
using nlp::Unit;

// The posture's joint speed per speed of the goal is at most this, rad/m.
constexpr double kPostureShare = 8;
// Directions of joint space that change the goal's functions by less than this are free, m²/rad².
constexpr double kFree = 1e-4;
// Of the joints' greatest velocities, for what the servo overshoots; of their greatest accelerations, to stop
// with.
constexpr double kWithinLimit = 0.96, kStop = 0.7;
// No row is worth a change of more than this many times a joint's greatest acceleration.
constexpr double kBurst = 20;
// A servo that leads a joint to its limit ends beyond what it was told by a little, rad.
constexpr double kServoGap = 2e-4;
// What a velocity has changed is forgotten at this rate, 1/s, by a servo as fast as those of robots are.
constexpr double kForget = 15;
// A row violated by less than this counts as held, m/s or rad/s.
constexpr double kNothing = 1e-9;

double Clamp(double value, double limit) { return std::clamp(value, -limit, limit); }

}  // namespace

void VelocityOptions::Validate() const {
  Diagnostics diagnostics;
  const OptionCheck check("the velocity controller", &diagnostics);
  check.Positive("gain", gain);
  check.Positive("damping", damping);
  check.Positive("rotation_weight", rotation_weight);
  check.Positive("field_gain", field_gain);
  check.Positive("joint_gain", joint_gain);
  check.NotNegative("joint_margin", joint_margin);
  check.NotNegative("buffer", buffer);
  check.NotNegative("angle_buffer", angle_buffer);
  check.Positive("velocity_share", velocity_share);
  check.NotNegative("servo_overshoot", servo_overshoot);
  check.NotNegative("ramp", ramp);
  check.Positive("period", period);
  check.NotNegative("self_distance", self_distance);
  check.Positive("range", range);
  check.Positive("escape_speed", escape_speed);
  check.NotNegative("posture_gain", posture_gain);
  check.NotNegative("posture_share", posture_share);
  check.NotNegative("posture_speed", posture_speed);
  diagnostics.ThrowIfAny();
}

ConstrainedVelocity::Impl::Impl(std::shared_ptr<const robot::Model> model_in, const Pose& X_WBase_in,
                                const std::vector<Solid>& objects,
                                const std::vector<ClearanceConstraint>& clearances,
                                std::vector<FieldConstraint> fields_in, const VelocityOptions& options_in)
    : ConstrainedArm(std::move(model_in), X_WBase_in, objects, clearances, std::move(fields_in),
                     options_in.self_distance),
      options(options_in),
      H(n, n),
      g(n),
      lower(n),
      upper(n),
      smooth_lower(n),
      smooth_upper(n),
      qdot(Eigen::VectorXd::Zero(n)),
      last_qdot(qdot),
      rise(qdot),
      fall(qdot),
      free_matrix(n, n),
      free_velocity(n),
      free_factor(n),
      goal_row(n) {
  options.Validate();
  SetRoom();
}

void ConstrainedVelocity::Impl::SetRoom() {
  values.resize(std::min(values.size(), fixed_fields));
  for (size_t i = values.size(); i < fields.size(); ++i) {
    const int size = fields[i].function->size();
    values.push_back({Eigen::MatrixXd(size, 12), Eigen::VectorXd(size)});
  }
  const size_t room = MostRows();
  if (room <= rows.size() && problem != nullptr) return;
  ReserveRows(room);
  levels.resize(room + n);
  const int m = static_cast<int>(room);
  problem = std::make_unique<qp::Problem>(n, 0, m);
  solver = std::make_unique<qp::Solver>(n, 0, m);
  conflict_problem = std::make_unique<qp::Problem>(n, 0, m + n);
  conflict_solver = std::make_unique<qp::HierarchySolver>(n, 0, m + n);
}

bool ConstrainedVelocity::Impl::TakeInput(const VelocityInput& input) {
  if (input.q.size() != n || !input.q.allFinite() || !std::isfinite(input.opening)) return false;
  if (!AllFinite(input.objects)) return false;
  kinematics.Set(input.q);
  PlaceBodies(input.opening, input.objects);
  return true;
}

void ConstrainedVelocity::Impl::AddRedundancy() {
  if (options.posture_gain <= 0 || options.posture_speed <= 0) return;
  // Where constraints couple it to the goal it must not delay the end of the goal: it becomes as slow as the
  // goal.
  const double wanted = options.gain * std::max(error_m, options.rotation_weight * error_rad);
  const double most = std::min({options.posture_speed, kPostureShare * wanted, most_speed});
  for (int i = 0; i < n; ++i) {
    const double half = 0.5 * (model->upper()[i] - model->lower()[i]);
    const double away = kinematics.q()[i] - 0.5 * (model->upper()[i] + model->lower()[i]);
    const double beyond = away - Clamp(away, options.posture_share * half);
    free_velocity[i] = -Clamp(options.posture_gain * beyond, most);
  }
  // N = ε (T + ε)⁻¹ with T = 2 Σ JᵀJ of the goal: the projector on its null space, to ε.
  free_matrix = H;
  free_matrix.diagonal().array() += kFree;
  free_factor.compute(free_matrix);
  free_factor.solveInPlace(free_velocity);
  g.noalias() -= 2 * options.damping * kFree * free_velocity;
}

// No change is asked for that the servo overshoots the limit with, or that is far beyond what the joint can
// do.
void ConstrainedVelocity::Impl::LimitChange(int joint, const double* v) {
  const double limit = kWithinLimit * model->max_velocity()[joint], over = 1 + options.servo_overshoot;
  const double o = options.servo_overshoot, now = qdot[joint];
  double &low = lower[joint], &high = upper[joint];
  high = std::min(high, std::max((limit - o * (rise[joint] - now)) / over, low));
  low = std::max(low, std::min((-limit + o * (fall[joint] + now)) / over, high));
  if (v != nullptr) {
    low = std::max(low, std::min(*v - (*v + limit) / over, high));
    high = std::min(high, std::max(*v + (limit - *v) / over, low));
  }
  const double hardest = kBurst * model->max_acceleration()[joint] * options.period;
  low = std::min(std::max(low, now - hardest), now + hardest);
  high = std::max(std::min(high, now + hardest), now - hardest);
}

void ConstrainedVelocity::Impl::SetBounds(const Eigen::VectorXd* v) {
  const bool measured = v != nullptr && v->size() == n && v->allFinite();
  for (int i = 0; i < n; ++i) {
    const double most = std::min(1.0, options.velocity_share) * model->max_velocity()[i];
    // ERRATA B2: the margin is measured from the limits, whatever their sign, and never beyond the middle.
    const double half = 0.5 * (model->upper()[i] - model->lower()[i]);
    const double margin = std::min(options.joint_margin + kServoGap, 0.9 * half);
    const double q = kinematics.q()[i];
    lower[i] = Clamp(options.joint_gain * (model->lower()[i] + margin - q), most);
    upper[i] = Clamp(options.joint_gain * (model->upper()[i] - margin - q), most);
    // A joint beyond its limit comes back slowly.
    lower[i] = std::min(lower[i], std::min(options.escape_speed, most));
    upper[i] = std::max(upper[i], -std::min(options.escape_speed, most));
    if (options.ramp > 0) LimitChange(i, measured ? &(*v)[i] : nullptr);
    // Limits come first: where the last velocity is beyond them, all of the change is allowed.
    const double change = options.ramp > 0 ? model->max_velocity()[i] * options.period / options.ramp : 1e3;
    smooth_lower[i] = std::clamp(qdot[i] - change, lower[i], upper[i]);
    smooth_upper[i] = std::clamp(qdot[i] + change, lower[i], upper[i]);
  }
}

void ConstrainedVelocity::Impl::NoteChange() {
  const double left = std::exp(-kForget * options.period);
  for (int i = 0; i < n; ++i) {
    rise[i] = left * rise[i] + std::max(0.0, qdot[i] - last_qdot[i]);
    fall[i] = left * fall[i] + std::max(0.0, last_qdot[i] - qdot[i]);
  }
  last_qdot = qdot;
}

// As fast as the joints can stop: a servo that is asked to stand at once overshoots.
void ConstrainedVelocity::Impl::Fault() {
  flags.fault = true;
  for (int i = 0; i < n; ++i) {
    const double most = kStop * model->max_acceleration()[i] * options.period;
    qdot[i] -= Clamp(qdot[i], most);
  }
}

void ConstrainedVelocity::Impl::Solve() {
  problem->Resize(n, 0, num_rows);
  problem->H() = H;
  problem->g() = g;
  problem->x_lower() = smooth_lower;
  problem->x_upper() = smooth_upper;
  auto A = problem->A();
  auto A_lower = problem->lower();
  for (int r = 0; r < num_rows; ++r) {
    const Row& row = rows[r];
    A.row(r) = Jacobian(r);
    A_lower[r] = Side(row);
  }
  const qp::Status status = solver->Solve(*problem);
  if (status == qp::Status::kInfeasible) return SolveConflict();
  if (status != qp::Status::kSolved || !solver->x().allFinite()) return Fault();
  qdot = solver->x().cwiseMax(lower).cwiseMin(upper);
}

void ConstrainedVelocity::Impl::SolveConflict() {
  // The bounds on changes become rows of the lowest priority.
  const int all = num_rows + n;
  conflict_problem->Resize(n, 0, all);
  conflict_problem->H() = H;
  conflict_problem->g() = g;
  conflict_problem->x_lower() = lower;
  conflict_problem->x_upper() = upper;
  auto A = conflict_problem->A();
  auto A_lower = conflict_problem->lower(), A_upper = conflict_problem->upper();
  int last = 1;
  for (int r = 0; r < num_rows; ++r) {
    const Row& row = rows[r];
    A.row(r) = Jacobian(r);
    A_lower[r] = Side(row);
    levels[r] = 1 + row.priority;
    last = std::max(last, 2 + row.priority);
  }
  for (int i = 0; i < n; ++i) {
    A.row(num_rows + i).setZero();
    A(num_rows + i, i) = 1;
    A_lower[num_rows + i] = smooth_lower[i];
    A_upper[num_rows + i] = smooth_upper[i];
    levels[num_rows + i] = last;
  }
  const qp::Status status = conflict_solver->Solve(
      *conflict_problem, std::span<const int>(levels.data(), static_cast<size_t>(all)));
  if (status != qp::Status::kSolved || !conflict_solver->x().allFinite()) return Fault();
  qdot = conflict_solver->x().cwiseMax(lower).cwiseMin(upper);
  double largest = kNothing;
  for (int r = 0; r < num_rows; ++r) {
    const double violation = conflict_solver->violations()[r];
    if (violation <= largest) continue;
    largest = violation;
    flags.relaxed = true;
    flags.violation = violation;
    flags.worst = rows[r].constraint;
  }
}

ConstrainedVelocity::ConstrainedVelocity(std::shared_ptr<const robot::Model> model, const Pose& X_WBase,
                                         const std::vector<Solid>& objects,
                                         const std::vector<ClearanceConstraint>& clearances,
                                         std::vector<FieldConstraint> fields, const VelocityOptions& options)
    : impl_(std::make_unique<Impl>(std::move(model), X_WBase, objects, clearances, std::move(fields),
                                   options)) {}
ConstrainedVelocity::~ConstrainedVelocity() = default;
ConstrainedVelocity::ConstrainedVelocity(ConstrainedVelocity&&) noexcept = default;
ConstrainedVelocity& ConstrainedVelocity::operator=(ConstrainedVelocity&&) noexcept = default;

const ArmBodies& ConstrainedVelocity::bodies() const { return impl_->bodies; }

void ConstrainedVelocity::SetExtraFields(std::vector<FieldConstraint> fields) {
  impl_->SetExtraFields(std::move(fields));
  impl_->SetRoom();
}

void ConstrainedVelocity::Allow(const std::vector<std::pair<int, int>>& pairs) {
  AllowPairs(impl_->bodies, pairs, impl_->pairs);
}

void ConstrainedVelocity::Hold(int object) { impl_->bodies.Hold(object); }
void ConstrainedVelocity::Release() { impl_->bodies.Release(); }

const Eigen::VectorXd& ConstrainedVelocity::Compute(const VelocityInput& input, const Goal* goal) {
  Impl& s = *impl_;
  s.flags = {};
  s.num_rows = 0;
  s.error_m = s.error_rad = 0;
  if (!s.TakeInput(input)) {
    s.Fault();
    return s.qdot;
  }
  s.H.setZero();
  s.g.setZero();
  s.AddPairRows();
  for (size_t i = 0; i < s.fields.size(); ++i) {
    s.AddFieldRows(s.fields[i], s.first_field + static_cast<int>(i), &s.values[i]);
  }
  s.ClearDust();
  if (!s.rows_finite) {
    s.Fault();
    return s.qdot;
  }
  s.FindViolation();
  if (goal != nullptr) s.AddGoal(*goal);
  if (goal != nullptr && goal->posture.size() == s.n) {
    s.AddPosture(*goal);
  } else if (goal != nullptr) {
    s.AddRedundancy();
  }
  s.H.diagonal().array() += 2 * s.options.damping;
  s.SetBounds(input.v);
  s.Solve();
  s.NoteChange();
  return s.qdot;
}

const VelocityFlags& ConstrainedVelocity::flags() const { return impl_->flags; }
int ConstrainedVelocity::num_rows() const { return impl_->num_rows; }
double ConstrainedVelocity::error_m() const { return impl_->error_m; }
double ConstrainedVelocity::error_rad() const { return impl_->error_rad; }
double ConstrainedVelocity::extra_violation_m() const { return impl_->ExtraViolation(Unit::kMetre); }
double ConstrainedVelocity::extra_violation_rad() const { return impl_->ExtraViolation(Unit::kRadian); }
int ConstrainedVelocity::num_constraints() const { return static_cast<int>(impl_->names.size()); }
const std::string& ConstrainedVelocity::constraint_name(int index) const { return impl_->names[index]; }
const ConstrainedVelocity::Row& ConstrainedVelocity::row(int index) const { return impl_->rows[index]; }
Eigen::RowVectorXd ConstrainedVelocity::row_jacobian(int index) const { return impl_->Jacobian(index); }

}  // namespace tether::control
