#include <array>
#include <cassert>
#include <cmath>
#include <limits>

#include "tether/control/constrained_velocity_impl.h"
#include "tether/geometry/distance/distance.h"

namespace tether::control {
namespace {

using Eigen::Vector3d;
using math::Pose;
using nlp::Unit;

// What is violated by less is at its limit: a cone is exactly active where it begins. m or rad.
constexpr double kRounding = 5e-4;
// Derivatives below this are rounding, m/rad.
constexpr double kDust = 1e-12;

}  // namespace

void ConstrainedVelocity::Impl::AddPairRows() {
  for (const ClearancePair& pair : pairs) {
    if (pair.allowed || !IsPresent(bodies, n, pair)) continue;
    const double near = pair.distance + options.buffer + options.range;
    const int link_a = bodies.link(pair.a), link_b = bodies.link(pair.b);
    for (const ArmBodies::Part* a = bodies.begin(pair.a); a != bodies.end(pair.a); ++a) {
      for (const ArmBodies::Part* b = bodies.begin(pair.b); b != bodies.end(pair.b); ++b) {
        if (ArmBodies::LowerBound(*a, *b) > near) continue;
        const geometry::Distance d = geometry::SignedDistance(a->primitive, a->X_BP, b->primitive, b->X_BP);
        if (d.distance > near) continue;
        double drift = 0;
        if (link_b == 0) {
          const MovingPose& moving = bodies.pose(pair.b);
          drift = d.n_W.dot(moving.V.head<3>() + moving.V.tail<3>().cross(d.p_WB - moving.X.p));
        }
        double* row = NewRow({pair.constraint, d.distance - pair.distance - options.buffer, drift,
                              options.buffer, pair.priority, pair.a, pair.b});
        AddAlong(kinematics, link_a, d.p_WA, d.n_W, -1, row);
        AddAlong(kinematics, link_b, d.p_WB, d.n_W, 1, row);
      }
    }
  }
}

Pose ConstrainedVelocity::Impl::FramePose(const Frame& frame, bool target, math::Vector6d* V) const {
  if (V != nullptr) V->setZero();
  if (frame.object < 0) return (target ? Pose() : kinematics.X_BH()) * frame.X_OF;
  const MovingPose& object = bodies.pose(bodies.object(frame.object));
  const Pose X_BF = object.X * frame.X_OF;
  if (V != nullptr) {
    V->head<3>() = object.V.head<3>() + object.V.tail<3>().cross(X_BF.p - object.X.p);
    V->tail<3>() = object.V.tail<3>();
  }
  return X_BF;
}

void ConstrainedVelocity::Impl::Chain(const Eigen::MatrixXd& J, int r, const Pose& X_BF, int link,
                                      double* row) const {
  const Vector3d along = X_BF.R * J.block<1, 3>(r, 6).transpose();
  const Vector3d about = X_BF.R * J.block<1, 3>(r, 9).transpose();
  for (int i = 0; i < link; ++i) {
    const Pose& X_BJ = kinematics.X_BL(i + 1);
    row[i] = X_BJ.R.col(2).dot((X_BF.p - X_BJ.p).cross(along) + about);
  }
}

double ConstrainedVelocity::Impl::Drift(const Eigen::MatrixXd& J, int r, const Pose& X_BT,
                                        const math::Vector6d& V_BT) {
  return (X_BT.R * J.block<1, 3>(r, 0).transpose()).dot(V_BT.head<3>()) +
         (X_BT.R * J.block<1, 3>(r, 3).transpose()).dot(V_BT.tail<3>());
}

void ConstrainedVelocity::Impl::AddFieldRows(const FieldConstraint& field, int constraint,
                                             FieldValue* value) {
  Frame frame = field.frame;
  if (frame.object != -1) {
    if (bodies.held() < 0 || (frame.object != kHeld && frame.object != bodies.held())) return;
    frame.object = bodies.held();
  }
  math::Vector6d V_BT;
  const std::array<Pose, 2> X{FramePose(field.target, true, &V_BT), FramePose(frame, false, nullptr)};
  nlp::JacobianRef J(value->J);
  field.function->Evaluate(X, value->r, &J);
  const double buffer =
      field.buffer.value_or(field.function->unit() == Unit::kMetre ? options.buffer : options.angle_buffer);
  for (int r = 0; r < value->r.size(); ++r) {
    double* row = NewRow(
        {constraint, -value->r[r] - buffer, -Drift(value->J, r, X[0], V_BT), buffer, field.priority, -1, -1});
    Chain(value->J, r, X[1], n, row);
    for (int i = 0; i < n; ++i) row[i] = -row[i];
  }
}

void ConstrainedVelocity::Impl::AddGoal(const Goal& goal) {
  math::Vector6d V_BT;
  const std::array<Pose, 2> X{FramePose(goal.target, true, &V_BT), FramePose(goal.frame, false, nullptr)};
  for (const constraints::PoseFunctionPtr& function : goal.functions) {
    const int size = function->size();
    assert(size <= kMostFunctionRows);
    nlp::JacobianRef J(goal_J.topRows(size));
    function->Evaluate(X, goal_r.head(size), &J);
    const bool metres = function->unit() == Unit::kMetre;
    const double norm = goal_r.head(size).norm();
    double& error = metres ? error_m : error_rad;
    error = std::max(error, norm);
    const double wanted = options.gain * norm,
                 limit = std::min(most_speed, metres ? goal.speed : goal.turn_speed);
    const double share = options.gain * (wanted > limit ? limit / wanted : 1.0);
    const double weight = metres ? 1.0 : options.rotation_weight;
    for (int r = 0; r < size; ++r) {
      goal_row.setZero();
      Chain(goal_J, r, X[1], n, goal_row.data());
      const double residual = share * goal_r[r] + Drift(goal_J, r, X[0], V_BT);
      H.noalias() += 2 * weight * weight * goal_row * goal_row.transpose();
      g += 2 * weight * weight * residual * goal_row;
    }
  }
}

void ConstrainedVelocity::Impl::AddPosture(const Goal& goal) {
  const double furthest = (kinematics.q() - goal.posture).cwiseAbs().maxCoeff();
  const double wanted = options.gain * furthest;
  const double limit = std::min(most_speed, goal.turn_speed);
  const double share = options.gain * (wanted > limit ? limit / wanted : 1.0);
  const double weight = 2 * options.rotation_weight * options.rotation_weight;
  for (int i = 0; i < n; ++i) {
    H(i, i) += weight;
    g[i] += weight * share * (kinematics.q()[i] - goal.posture[i]);
  }
  error_rad = std::max(error_rad, furthest);
}

double ConstrainedVelocity::Impl::ExtraViolation(Unit unit) const {
  double most = 0;
  const int first = first_field + static_cast<int>(fixed_fields);
  for (int r = 0; r < num_rows; ++r) {
    const Row& row = rows[r];
    if (row.constraint < first || row.priority > 0) continue;
    if (fields[row.constraint - first_field].function->unit() == unit)
      most = std::max(most, -(row.value + row.buffer));
  }
  return most;
}

void ConstrainedVelocity::Impl::ClearDust() {
  const size_t size = num_rows * n;
  double sum = 0;  // not finite if one of its terms isn't
  for (size_t i = 0; i < size; ++i) {
    if (std::abs(jacobians[i]) < kDust) jacobians[i] = 0;
    sum += 0 * jacobians[i];
  }
  for (int r = 0; r < num_rows; ++r) {
    const Row& row = rows[r];
    sum += 0 * (row.value + row.drift);
  }
  rows_finite = sum == 0;
}

void ConstrainedVelocity::Impl::FindViolation() {
  most_speed = std::numeric_limits<double>::infinity();
  for (int r = 0; r < num_rows; ++r) {
    const Row& row = rows[r];
    if (row.value >= -row.buffer - kRounding) continue;
    if (row.priority == 0) most_speed = options.escape_speed;
    if (flags.worst >= 0 && -row.value <= flags.violation) continue;
    flags.escaping = true;
    flags.worst = row.constraint;
    flags.violation = -row.value;
  }
}

}  // namespace tether::control
