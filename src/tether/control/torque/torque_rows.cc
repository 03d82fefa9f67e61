#include <algorithm>
#include <array>
#include <cmath>

#include "tether/control/torque/constrained_torque_impl.h"
#include "tether/geometry/distance/distance.h"

namespace tether::control {
namespace {

using Eigen::Vector3d;
using math::Pose;
using math::Vector6d;
using nlp::Unit;

// Derivatives below this are rounding, m/rad.
constexpr double kDust = 1e-12;
// How far along the motion the derivatives of fields are looked at, s: their change is exact to its square.
constexpr double kAlong = 1e-4;
// Turning normals and sliding witness points count no more than this, m/s²: the distance has kinks.
constexpr double kMostSliding = 20;
// Every bound must be one, m/s² and m/s³.
constexpr double kLeastBraking = 0.01;
// Pairs that close in with speed c matter within so much of their safe distance: kStill + kReact c + c² / 2a,
// m, s, m/s².
constexpr double kStill = 0.04;
constexpr double kReact = 0.1;
constexpr double kStop = 1.5;

// Further than anything, m.
constexpr double kNowhere = 1e6;
// What moves faster is not led further, m/s.
constexpr double kFastest = 0.5;

double Matters(double speed) {
  speed = std::max(0.0, speed);
  return kStill + kReact * speed + speed * speed / (2 * kStop);
}

}  // namespace

void ConstrainedTorque::Impl::SetRoom() {
  const size_t room = MostRows();
  if (pair_bounds.empty()) pair_bounds.Resize(bodies, pairs.size(), NumPartPairs(bodies, pairs));
  if (room <= rows.size() && problem != nullptr) return;
  ReserveRows(room);
  candidates.resize(room);
  chosen.resize(room);
  sides.resize(room);
  const int m = static_cast<int>(room) + n;
  levels.resize(room + 4 * n);
  qp::SolverOptions solver_options;
  solver_options.max_iterations = options.max_iterations;
  solver_options.max_solves = options.max_solves;
  problem = std::make_unique<qp::Problem>(n, 0, m);
  solver = std::make_unique<qp::Solver>(n, 0, m, solver_options);
  conflict_problem = std::make_unique<qp::Problem>(n, 0, m + 3 * n);
  conflict_solver = std::make_unique<qp::HierarchySolver>(n, 0, m + 3 * n, solver_options);
}

// Near its limit a value comes down to zero as e^(−kt) at most.
double ConstrainedTorque::Impl::NeededNear(double value, double rate) const {
  const double k = options.field_rate, damping = options.field_damping;
  return std::min(-(k + damping) * rate - k * damping * value, options.most_needed);
}

// Further away it may shrink as fast as it can still be braked with what all joints have together.
double ConstrainedTorque::Impl::NeededToStop(const Row& row, const double* slope, double most) const {
  if (row.rate >= 0 || row.value <= 0) return -most;
  Braking braking{0, 0};
  for (int i = 0; i < n; ++i) {
    const Braking of_joint = reserve.of(i);
    braking.deceleration += std::abs(slope[i]) * of_joint.deceleration;
    braking.jerk += std::abs(slope[i]) * of_joint.jerk;
  }
  braking.deceleration =
      std::max(kLeastBraking, std::min(options.field_share * braking.deceleration, options.field_braking));
  braking.jerk = std::max(kLeastBraking, options.field_share * braking.jerk);
  return -MostAccelerationToStop(row.value, -row.rate, most, braking.deceleration, 0, options.period,
                                 braking);
}

void ConstrainedTorque::Impl::MoveBodies() {
  pair_bounds.Follow(bodies);
  for (int body = 0; body < bodies.num_bodies(); ++body) {
    const int link = bodies.link(body);
    const MovingPose& pose = bodies.pose(body);
    if (link > 0) {
      const PointMotion origin = motion.At(link, pose.X.p);
      pair_bounds.Move(body, origin.v, origin.w);
    } else if (bodies.is_object(body)) {
      pair_bounds.Move(body, pose.V.head<3>(), pose.V.tail<3>());
    }
  }
}

void ConstrainedTorque::Impl::AddPairRows() {
  MoveBodies();
  size_t number = 0, next_parts = 0;
  for (const ClearancePair& pair : pairs) {
    const size_t this_pair = number++;
    size_t parts = next_parts;
    next_parts +=
        static_cast<size_t>(bodies.max_parts(pair.a)) * static_cast<size_t>(bodies.max_parts(pair.b));
    if (!IsPresent(bodies, n, pair)) continue;
    const double fastest_b = pair_bounds.Fastest(pair.b), speed = pair_bounds.Fastest(pair.a) + fastest_b;
    const int link_a = bodies.link(pair.a), link_b = bodies.link(pair.b);
    const double moves = link_b == 0 ? std::min(kFastest, fastest_b) : 0;
    const double lead = options.lead * moves;
    const double near = pair.allowed
                            ? options.contact.touch
                            : pair.distance + options.buffer + lead + std::min(options.range, Matters(speed));
    if (pair_bounds.OfPair(this_pair, pair.a, pair.b) > near) continue;
    const double required = pair.distance + options.buffer + lead;
    double least = kNowhere;
    for (const ArmBodies::Part* a = bodies.begin(pair.a); a != bodies.end(pair.a); ++a) {
      for (const ArmBodies::Part* b = bodies.begin(pair.b); b != bodies.end(pair.b); ++b, ++parts) {
        double bound = pair_bounds.OfParts(parts, pair.a, pair.b);
        // Further away than what matters of how fast it is approached.
        const bool clear = !pair.allowed && bound > options.contact.touch && bound - required > kStill &&
                           bound - required > Matters(pair_bounds.Closing(parts, pair.a, pair.b));
        if (bound <= near && !clear) {
          bound = ArmBodies::LowerBound(*a, *b);
          if (bound > near) pair_bounds.NoteParts(parts, pair.a, pair.b, bound);
        }
        if (bound > near || clear) {
          least = std::min(least, bound);
          continue;
        }
        const geometry::Distance d = geometry::SignedDistance(a->primitive, a->X_BP, b->primitive, b->X_BP);
        pair_bounds.NoteParts(parts, pair.a, pair.b, d.distance, d.n_W);
        least = std::min(least, d.distance);
        if (d.distance > near) continue;
        const PointMotion of_a = motion.At(link_a, d.p_WA);
        PointMotion of_b;
        if (link_b == 0) {
          const MovingPose& moving = bodies.pose(pair.b);
          const Vector3d w = moving.V.tail<3>();
          of_b = {moving.V.head<3>() + w.cross(d.p_WB - moving.X.p), w};
        } else {
          of_b = motion.At(link_b, d.p_WB);
        }
        Row row;
        row.constraint = pair.constraint;
        row.buffer = options.buffer + lead;
        row.value = d.distance - required;
        row.rate = d.n_W.dot(of_b.v - of_a.v);
        if (!pair.allowed && row.value > Matters(-row.rate) && d.distance > options.contact.touch) continue;
        row.needed = NeededNear(row.value, row.rate);
        row.priority = pair.priority;
        row.a = pair.a;
        row.b = pair.b;
        row.allowed = pair.allowed;
        const Vector3d bias_b = link_b == 0 ? of_b.w.cross(of_b.w.cross(d.p_WB - bodies.pose(pair.b).X.p))
                                            : motion.PointBias(link_b, d.p_WB);
        row.bias =
            d.n_W.dot(bias_b - motion.PointBias(link_a, d.p_WA)) +
            std::clamp(SlidingAcceleration(d, a->primitive, a->X_BP, of_a, b->primitive, b->X_BP, of_b),
                       -kMostSliding, kMostSliding);
        double* jacobian = NewRow(row);
        AddAlong(kinematics, link_a, d.p_WA, d.n_W, -1, jacobian);
        AddAlong(kinematics, link_b, d.p_WB, d.n_W, 1, jacobian);
        for (int i = 0; i < n; ++i) {
          if (std::abs(jacobian[i]) < kDust) jacobian[i] = 0;
        }
        if (d.distance < options.contact.touch) {
          candidates[static_cast<size_t>(num_candidates++)] = {num_rows - 1, pair.a,     pair.b,
                                                               pair.allowed, d.distance, jacobian};
        }
      }
    }
    pair_bounds.NotePair(this_pair, pair.a, pair.b, least);
  }
}

ConstrainedTorque::Impl::MovingFrame ConstrainedTorque::Impl::FrameNow(const Frame& frame,
                                                                       bool target) const {
  MovingFrame now;
  Vector3d velocity = Vector3d::Zero(), w = velocity, a = velocity, alpha = velocity;
  const auto of_link = [&](int link) {
    const PointMotion moving = motion.At(link, now.X_BF.p);
    velocity = moving.v;
    w = moving.w;
    a = motion.PointBias(link, now.X_BF.p);
    alpha = motion.AngularBias(link);
  };
  if (frame.object < 0) {
    now.X_BF = (target ? Pose() : kinematics.X_BH()) * frame.X_OF;
    if (!target) of_link(n);
  } else {
    const MovingPose& object = bodies.pose(bodies.object(frame.object));
    now.X_BF = object.X * frame.X_OF;
    if (!target) {
      of_link(n);
    } else {
      w = object.V.tail<3>();
      const Vector3d r = now.X_BF.p - object.X.p;
      velocity = object.V.head<3>() + w.cross(r);
      a = w.cross(w.cross(r));
    }
  }
  const Eigen::Matrix3d R = now.X_BF.R.transpose();
  now.V << R * velocity, R * w;
  now.A << R * (a - w.cross(velocity)), R * alpha;
  return now;
}

void ConstrainedTorque::Impl::Evaluate(const constraints::PoseFunction& function, const Frame& target,
                                       const Frame& frame, FunctionRows& out) const {
  const int size = function.size();
  const MovingFrame T = FrameNow(target, true), F = FrameNow(frame, false);
  const auto at = [&](double s, Eigen::MatrixXd& J_out, Eigen::VectorXd& r_out) {
    const auto moved = [s](const MovingFrame& frame_now) {
      return s == 0 || frame_now.V.isZero(0) ? frame_now.X_BF
                                             : frame_now.X_BF * math::ExpSE3(s * frame_now.V);
    };
    const std::array<Pose, 2> X = {moved(T), moved(F)};
    nlp::JacobianRef J_rows(J_out.topRows(size));
    function.Evaluate(X, r_out.head(size), &J_rows);
  };
  at(kAlong, out.J_after, out.unused);
  at(-kAlong, out.J_before, out.unused);
  at(0, out.J, out.r);
  for (int r = 0; r < size; ++r) {
    const auto J_T = out.J.row(r).head<6>(), J_F = out.J.row(r).tail<6>();
    out.rate[r] = J_T.dot(T.V) + J_F.dot(F.V);
    const double change = (out.J_after.row(r).head<6>() - out.J_before.row(r).head<6>()).dot(T.V) +
                          (out.J_after.row(r).tail<6>() - out.J_before.row(r).tail<6>()).dot(F.V);
    out.bias[r] = J_T.dot(T.A) + J_F.dot(F.A) + change / (2 * kAlong);
    const Vector3d along = F.X_BF.R * J_F.head<3>().transpose();
    const Vector3d about = F.X_BF.R * J_F.tail<3>().transpose();
    for (int i = 0; i < n; ++i) {
      const Pose& X_BJ = kinematics.X_BL(i + 1);
      const double slope = X_BJ.R.col(2).dot((F.X_BF.p - X_BJ.p).cross(along) + about);
      out.A(r, i) = std::abs(slope) < kDust ? 0 : slope;
    }
  }
}

void ConstrainedTorque::Impl::AddFieldRows(const FieldConstraint& spec, int constraint) {
  Frame frame = spec.frame;
  if (frame.object != -1) {
    if (bodies.held() < 0 || (frame.object != kHeld && frame.object != bodies.held())) return;
    frame.object = bodies.held();
  }
  Evaluate(*spec.function, spec.target, frame, function_rows);
  const double buffer =
      spec.buffer.value_or(spec.function->unit() == Unit::kMetre ? options.buffer : options.angle_buffer);
  for (int r = 0; r < spec.function->size(); ++r) {
    Row row;
    row.constraint = constraint;
    row.buffer = buffer;
    row.value = -function_rows.r[r] - buffer;
    row.rate = -function_rows.rate[r];
    row.bias = -function_rows.bias[r];
    row.priority = spec.priority;
    row.needed = NeededNear(row.value, row.rate);
    double* jacobian = NewRow(row);
    for (int i = 0; i < n; ++i) jacobian[i] = -function_rows.A(r, i);
  }
}

}  // namespace tether::control
