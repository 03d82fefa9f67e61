#include "tether/constraints/core/field_function.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "tether/constraints/core/relative.h"

namespace tether::constraints {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using internal::Relative;
using math::Pose;
using nlp::JacobianRef;
using nlp::Unit;
using nlp::VectorRef;

// Sines below this count as parallel.
constexpr double kParallel = 1e-8;

class LineDistance final : public PoseFunction {
 public:
  LineDistance(const Line& line_B, const Line& line_A, double distance, double sign)
      : PoseFunction(1, 2, Unit::kMetre), b_(line_B), a_(line_A), distance_(distance), sign_(sign) {}

  void Evaluate(std::span<const Pose> X, VectorRef r, JacobianRef* J) const override {
    const Relative relative(X[0], X[1]);
    const Vector3d u = relative.X_BA.R * a_.u;
    const Vector3d between = relative.X_BA * a_.p - b_.p;  // from B's point to A's
    const double c = b_.u.dot(u);
    const double sine2 = b_.u.cross(u).squaredNorm();
    // The nearest points: `t` along A's line. The lines part along n.
    const double t = sine2 > kParallel * kParallel ? (c * b_.u.dot(between) - u.dot(between)) / sine2 : 0.0;
    Vector3d gap = between + t * u;
    gap -= b_.u * b_.u.dot(gap);
    const double norm = gap.norm();
    r[0] = sign_ * (norm - distance_);
    if (J == nullptr) return;
    const Vector3d n = norm > 0 ? Vector3d(sign_ * gap / norm) : Vector3d::Zero();
    // Moving A moves its nearest point; B's moves along B's line only, across n.
    relative.PointRow(n, a_.p + t * a_.u, 0, 0, 6, *J);
  }

 private:
  Line b_, a_;
  double distance_, sign_;
};

class Angle final : public PoseFunction {
 public:
  Angle(const Vector3d& d_A, const Vector3d& e_B, double max, double per_height, const Vector3d& p_AQ)
      : PoseFunction(1, 2, Unit::kRadian),
        d_A_(d_A),
        e_B_(e_B),
        max_(max),
        per_height_(per_height),
        p_AQ_(p_AQ) {}

  void Evaluate(std::span<const Pose> X, VectorRef r, JacobianRef* J) const override {
    const Relative relative(X[0], X[1]);
    const Vector3d d_B = relative.X_BA.R * d_A_;
    Vector3d axis = e_B_.cross(d_B);
    const double sine = axis.norm();
    const double height = std::max(0.0, (relative.X_BA * p_AQ_).z());
    r[0] = std::atan2(sine, e_B_.dot(d_B)) - max_ - per_height_ * height;
    if (J == nullptr) return;
    relative.PointRow(Vector3d(0, 0, height > 0 ? -per_height_ : 0), p_AQ_, 0, 0, 6, *J);
    if (sine == 0) return;
    axis /= sine;
    J->block<1, 3>(0, 9) += (relative.X_BA.R.transpose() * axis).transpose();
    J->block<1, 3>(0, 3) -= axis.transpose();
  }

 private:
  Vector3d d_A_, e_B_;
  double max_, per_height_;
  Vector3d p_AQ_;
};

class PointCone final : public PoseFunction {
 public:
  PointCone(double radius, const Vector3d& start, const Vector3d& p_AQ)
      : PoseFunction(1, 2, Unit::kMetre),
        radius_(radius),
        slope_(std::max(0.0, start.head<2>().norm() - radius) / start.z()),
        p_AQ_(p_AQ) {
    assert(start.z() != 0);
  }

  void Evaluate(std::span<const Pose> X, VectorRef r, JacobianRef* J) const override {
    const Relative relative(X[0], X[1]);
    const Vector3d p = relative.X_BA * p_AQ_;
    const double across = p.head<2>().norm();
    const double rho = radius_ + slope_ * p.z();
    r[0] = across - std::max(0.0, rho);
    if (J == nullptr) return;
    Vector3d n(0, 0, rho > 0 ? -slope_ : 0);
    if (across > 0) n.head<2>() = p.head<2>() / across;
    relative.PointRow(n, p_AQ_, 0, 0, 6, *J);
  }

 private:
  double radius_, slope_;
  Vector3d p_AQ_;
};

}  // namespace

PoseFunctionPtr MakeLineDistance(const Line& line_B, const Line& line_A, double distance, double sign) {
  return std::make_shared<LineDistance>(line_B, line_A, distance, sign);
}

PoseFunctionPtr MakeAngle(const Vector3d& d_A, const Vector3d& e_B, double max) {
  return std::make_shared<Angle>(d_A, e_B, max, 0, Vector3d::Zero());
}

PoseFunctionPtr MakeNarrowingAngle(const Vector3d& d_A, const Vector3d& e_B, double max, double per_height,
                                   const Vector3d& p_AQ) {
  return std::make_shared<Angle>(d_A, e_B, max, per_height, p_AQ);
}

PoseFunctionPtr MakePointCone(double radius, const Vector3d& p_BQ_start, const Vector3d& p_AQ) {
  return std::make_shared<PointCone>(radius, p_BQ_start, p_AQ);
}

PoseFunctionPtr MakeFrustum(const Vector2d& size, const Vector3d& p_BQ_start, const Vector3d& p_AQ) {
  assert(p_BQ_start.z() != 0);
  std::vector<HalfSpaceRow> rows;
  for (int axis = 0; axis < 2; ++axis) {
    for (const double side : {1.0, -1.0}) {
      const double half = size[axis] / 2;
      const double slope = std::max(0.0, side * p_BQ_start[axis] - half) / p_BQ_start.z();
      Vector3d n = side * Vector3d::Unit(axis) - slope * Vector3d::UnitZ();
      rows.push_back({p_AQ, n / n.norm(), half / n.norm()});
    }
  }
  return MakeHalfSpaces(std::move(rows));
}

}  // namespace tether::constraints
