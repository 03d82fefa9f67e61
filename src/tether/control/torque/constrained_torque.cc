#include "tether/control/torque/constrained_torque.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "tether/common/document/option_check.h"
#include "tether/common/error.h"
#include "tether/control/torque/constrained_torque_impl.h"
#include "tether/robot/gravity.h"

namespace tether::control {

using Eigen::Vector3d;
using math::Pose;

namespace {

// While a force, or a torque of a joint, of more than this is felt, nothing is learned of sensors and
// payload, N and Nm.
constexpr double kLearnBelow = 6, kLearnTorque = 1.2;

LoadEstimatorOptions LoadOptions(const TorqueOptions& options) {
  LoadEstimatorOptions load = options.load;
  load.period = options.period;
  return load;
}

}  // namespace

void TorqueOptions::Validate() const {
  gains.Validate();
  Diagnostics diagnostics;
  const OptionCheck check("the torque controller", &diagnostics);
  check.Positive("period", period);
  check.Positive("null_weight", null_weight);
  check.Positive("rotation_weight", rotation_weight);
  check.Positive("field_rate", field_rate);
  check.Positive("field_damping", field_damping);
  check.Share("field_share", field_share);
  check.Positive("field_braking", field_braking);
  check.NotNegative("buffer", buffer);
  check.NotNegative("angle_buffer", angle_buffer);
  check.Share("velocity_share", velocity_share);
  check.Share("torque_share", torque_share);
  check.Share("rate_share", rate_share);
  check.Share("rate_margin", rate_margin);
  check.NotNegative("joint_margin", joint_margin);
  check.NotNegative("limit_gap", limit_gap);
  check.Positive("return_speed", return_speed);
  check.NotNegative("self_distance", self_distance);
  check.Positive("range", range);
  check.Positive("most_needed", most_needed);
  check.Positive("brake_rate", brake_rate);
  check.Positive("contact.threshold", contact.threshold);
  check.NotNegative("contact.hold", contact.hold);
  check.Positive("contact.filter", contact.filter);
  check.NotNegative("contact.touch", contact.touch);
  check.Positive("contact.released", contact.released);
  check.NotNegative("contact.released_for", contact.released_for);
  check.NotNegative("lead", lead);
  check.NotNegative("contact.retreat", contact.retreat);
  check.NotNegative("contact.yield", contact.yield);
  check.Positive("max_iterations", max_iterations);
  check.Positive("max_solves", max_solves);
  diagnostics.ThrowIfAny();
}

ConstrainedTorque::Impl::Impl(std::shared_ptr<const robot::Model> model_in, const Pose& X_WBase_in,
                              const std::vector<Solid>& objects,
                              const std::vector<ClearanceConstraint>& clearances,
                              std::vector<FieldConstraint> fields_in, const TorqueOptions& options_in)
    : ConstrainedArm(std::move(model_in), X_WBase_in, objects, clearances, std::move(fields_in),
                     options_in.self_distance),
      options(options_in),
      reserve(*model),
      watch(n, options.contact),
      load(n, X_BW.R * Vector3d(0, 0, -robot::kGravity), LoadOptions(options)),
      M(n, n),
      Minv(n, n),
      J(6, n),
      weighted_J(6, n),
      MinvJt(n, 6),
      M_llt(n),
      H(n, n) {
  options.Validate();
  for (Eigen::VectorXd* vector : {&v,
                                  &carried,
                                  &hold,
                                  &g,
                                  &tau_lower,
                                  &tau_upper,
                                  &middle,
                                  &half,
                                  &velocity_lower,
                                  &velocity_upper,
                                  &position_lower,
                                  &position_upper,
                                  &smooth_lower,
                                  &smooth_upper,
                                  &lower,
                                  &upper,
                                  &work,
                                  &unexplained,
                                  &thrown,
                                  &across,
                                  &wanted,
                                  &goal_row,
                                  &qddot,
                                  &torque}) {
    vector->setZero(n);
  }
  function_rows.A.setZero(kMostFunctionRows, n);
  for (Eigen::MatrixXd* matrix : {&function_rows.J, &function_rows.J_after, &function_rows.J_before}) {
    matrix->setZero(kMostFunctionRows, 12);
  }
  function_rows.unused.setZero(kMostFunctionRows);
  SetRoom();
}

bool ConstrainedTorque::Impl::TakeInput(const TorqueInput& input, const TorqueTask& task) {
  const robot::State& state = input.state;
  if (!state.q().allFinite() || !state.v().allFinite() || !state.M().allFinite() ||
      !state.bias().allFinite() || !state.J_BH().allFinite()) {
    return false;
  }
  task_finite = std::isfinite(task.max_force) && (task.hand == nullptr || IsFinite(*task.hand)) &&
                (task.posture == nullptr || task.posture->allFinite()) &&
                (task.velocities == nullptr || task.velocities->allFinite());
  rows_finite = std::isfinite(input.opening) && AllFinite(input.objects);
  v = state.v();
  M = state.M();
  J = state.J_BH();
  hold = state.bias();
  M_llt.compute(M);
  if (M_llt.info() != Eigen::Success) return false;
  Minv.setIdentity();
  M_llt.solveInPlace(Minv);
  if (task.hand != nullptr && task.hand->F_BH.allFinite()) {
    carried.noalias() = J.transpose() * task.hand->F_BH;
    hold += carried;
  } else {
    carried.noalias() = J.transpose() * load.Holding(state.X_BH());
    hold += carried;
  }
  kinematics.Set(state.q());
  motion.Set(kinematics, v);
  if (!rows_finite) return true;
  PlaceBodies(input.opening, input.objects);
  return true;
}

void ConstrainedTorque::Impl::WatchContact(const TorqueInput& input, const TorqueTask& task) {
  if (input.external == nullptr) return;
  // Torques that a contact may be part of tell nothing of sensors and payload.
  bool touches = watch.contact().active || watch.contact().force > kLearnBelow ||
                 watch.felt().cwiseAbs().maxCoeff() > kLearnTorque;
  for (int i = 0; i < num_candidates && !touches; ++i) {
    const ContactCandidate& near = candidates[static_cast<size_t>(i)];
    const int held = bodies.held() < 0 ? -1 : bodies.object(bodies.held());
    touches = held < 0 || (near.a != held && near.b != held) || bodies.link(near.a) != n ||
              bodies.link(near.b) != n;
  }
  load.Update(input.state, *input.external, touches);
  unexplained = *input.external - load.sensor_error() + carried;
  if (!load.settled()) unexplained.setZero();
  watch.Update(candidates, num_candidates, unexplained, J, load.weight_error(), task.max_force,
               options.period);
  flags.yielding = watch.contact().active;
}

void ConstrainedTorque::Impl::AddObjective(const TorqueTask& task) {
  H.setZero();
  g.setZero();
  // Where something is not finite the arm brakes, under the constraints that are known.
  flags.fault = !rows_finite || !task_finite;
  if (flags.fault || (task.hand == nullptr && task.goal == nullptr && task.velocities == nullptr)) {
    AddBrake(1, options.brake_rate);
  } else if (flags.yielding) {
    AddRetreat();
  } else if (task.velocities != nullptr) {
    AddVelocities(*task.velocities, task.max_force);
  } else {
    if (task.hand != nullptr) AddHand(*task.hand, task.max_force);
    if (task.goal != nullptr) AddGoal(*task.goal, task.max_force);
    if (task.joints != nullptr) {
      AddJoints(*task.joints);
    } else {
      AddPosture(task.posture);
    }
  }
}

// Without a state that can be trusted: the last torques go towards those that hold the arm, and brake it as
// far as its velocity is known.
void ConstrainedTorque::Impl::Fault(const TorqueInput& input) {
  flags.fault = true;
  const robot::State& state = input.state;
  const double dt = options.period * options.rate_margin;
  work = state.bias().allFinite() ? state.bias() : torque;
  if (state.v().allFinite()) {
    if (state.M().allFinite()) {
      work -= options.brake_rate * state.M().diagonal().cwiseProduct(state.v());
    } else {
      work -= state.v();
    }
  }
  if (!started) torque = work;
  for (int i = 0; i < n; ++i) {
    const double change = dt * model->max_torque_rate()[i], most = model->max_torque()[i];
    torque[i] = std::clamp(std::clamp(work[i], torque[i] - change, torque[i] + change), -most, most);
  }
  started = true;
  qddot.setZero();
}

ConstrainedTorque::ConstrainedTorque(std::shared_ptr<const robot::Model> model, const Pose& X_WBase,
                                     const std::vector<Solid>& objects,
                                     const std::vector<ClearanceConstraint>& clearances,
                                     std::vector<FieldConstraint> fields, const TorqueOptions& options)
    : impl_(std::make_unique<Impl>(std::move(model), X_WBase, objects, clearances, std::move(fields),
                                   options)) {}
ConstrainedTorque::~ConstrainedTorque() = default;
ConstrainedTorque::ConstrainedTorque(ConstrainedTorque&&) noexcept = default;
ConstrainedTorque& ConstrainedTorque::operator=(ConstrainedTorque&&) noexcept = default;

const ArmBodies& ConstrainedTorque::bodies() const { return impl_->bodies; }
const TorqueOptions& ConstrainedTorque::options() const { return impl_->options; }

void ConstrainedTorque::SetExtraFields(std::vector<FieldConstraint> fields) {
  impl_->SetExtraFields(std::move(fields));
  impl_->SetRoom();
}

void ConstrainedTorque::Allow(std::span<const std::pair<int, int>> pairs) {
  AllowPairs(impl_->bodies, pairs, impl_->pairs);
}

void ConstrainedTorque::Hold(int object) {
  impl_->bodies.Hold(object);
  impl_->load.Carry(true);
}
void ConstrainedTorque::Release() {
  impl_->bodies.Release();
  impl_->load.Carry(false);
}

const Eigen::VectorXd& ConstrainedTorque::Compute(const TorqueInput& input, const TorqueTask& task) {
  Impl& s = *impl_;
  s.flags = {};
  s.num_rows = s.num_candidates = s.num_chosen = 0;
  s.error_m = s.error_rad = 0;
  if (!s.TakeInput(input, task)) {
    s.Fault(input);
    return s.torque;
  }
  s.SetTorqueBox();
  s.SetJointBounds();
  if (s.rows_finite) {
    s.AddPairRows();
    for (size_t i = 0; i < s.fields.size(); ++i) {
      s.AddFieldRows(s.fields[i], s.first_field + static_cast<int>(i));
    }
    s.ChooseRows();
    s.WatchContact(input, task);
  }
  s.AddObjective(task);
  s.Solve();
  s.torque.noalias() = s.M * s.qddot;
  s.torque += s.hold;
  s.torque = s.torque.cwiseMax(s.tau_lower).cwiseMin(s.tau_upper);
  s.Report();
  return s.torque;
}

void ConstrainedTorque::SetLast(const Eigen::VectorXd& torque) {
  impl_->torque = torque;
  impl_->started = true;
}
void ConstrainedTorque::Restart() {
  impl_->started = false;
  impl_->watch.Reset();
  impl_->load.Reset();
}

const TorqueFlags& ConstrainedTorque::flags() const { return impl_->flags; }
const Contact& ConstrainedTorque::contact() const { return impl_->watch.contact(); }
const Eigen::VectorXd& ConstrainedTorque::felt() const { return impl_->watch.felt(); }
const LoadEstimator& ConstrainedTorque::load() const { return impl_->load; }
const Eigen::VectorXd& ConstrainedTorque::acceleration() const { return impl_->qddot; }
double ConstrainedTorque::error_m() const { return impl_->error_m; }
double ConstrainedTorque::error_rad() const { return impl_->error_rad; }
int ConstrainedTorque::num_rows() const { return impl_->num_rows; }
const ConstrainedTorque::Row& ConstrainedTorque::row(int index) const {
  return impl_->rows[static_cast<size_t>(index)];
}
Eigen::RowVectorXd ConstrainedTorque::row_jacobian(int index) const { return impl_->Jacobian(index); }
int ConstrainedTorque::num_qp_rows() const { return impl_->num_chosen; }
int ConstrainedTorque::num_constraints() const { return static_cast<int>(impl_->names.size()); }
const std::string& ConstrainedTorque::constraint_name(int index) const {
  return impl_->names[static_cast<size_t>(index)];
}

}  // namespace tether::control
