#include "tether/control/torque/distance_acceleration.h"

#include <algorithm>
#include <cmath>
#include <variant>

#include "tether/geometry/hull/polytope.h"
#include "tether/math/infinity.h"

namespace tether::control {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// The radius of curvature that stands for that of a flat surface, m.
constexpr double kFlat = 1e5;
// Components of a normal below this are none.
constexpr double kAligned = 1e-6;
// Cylinders' normals are found by iteration, to about this.
constexpr double kCylinderAligned = 2e-5;
// Two directions in the tangent plane whose cosine is above this are parallel.
constexpr double kParallel = 1 - 1e-6;
// Vertices nearer than this count as this far apart: the normal turns no faster, m.
constexpr double kLeastRadius = 0.002;

/// A surface about its witness point: directions are in the body's frame, unit, in the tangent plane.
struct Surface {
  int num_flat = 0;
  Vector3d flat = Vector3d::Zero();   ///< With num_flat 1.
  Vector3d round = Vector3d::Zero();  ///< The other direction …
  double radius = 0;                  ///< … and its radius of curvature, m.
  double all_round = 0;               ///< Of all directions, m: a ball.
};

Surface Of(const geometry::Box&, const Vector3d& m, const Vector3d&) {
  Surface surface;
  for (int i = 0; i < 3; ++i) {
    if (std::abs(m[i]) > kAligned) continue;
    ++surface.num_flat;
    surface.flat = Vector3d::Unit(i);
  }
  return surface;
}

Surface Of(const geometry::Sphere& sphere, const Vector3d&, const Vector3d&) {
  Surface surface;
  surface.all_round = sphere.radius;
  return surface;
}

Surface Of(const geometry::Capsule& capsule, const Vector3d& m, const Vector3d& p) {
  Surface surface;
  if (std::abs(m.z()) > kAligned || std::abs(p.z()) > 0.5 * capsule.length + kAligned) {
    surface.all_round = capsule.radius;
    return surface;
  }
  surface.num_flat = 1;
  surface.flat = Vector3d::UnitZ();
  surface.round = Vector3d::UnitZ().cross(m).normalized();
  surface.radius = capsule.radius;
  return surface;
}

Surface Of(const geometry::Cylinder& cylinder, const Vector3d& m, const Vector3d&) {
  Surface surface;
  const double across = m.head<2>().norm();
  if (across < kCylinderAligned) {
    surface.num_flat = 2;
    return surface;
  }
  surface.round = Vector3d(-m.y(), m.x(), 0) / across;
  surface.radius = cylinder.radius / across;
  if (std::abs(m.z()) > kCylinderAligned) return surface;
  surface.num_flat = 1;
  surface.flat = Vector3d::UnitZ();
  return surface;
}

Surface Of(const geometry::Hull& hull, const Vector3d& m, const Vector3d&) {
  Surface surface;
  double most = -math::kInfinity;
  for (const Vector3d& p : hull.polytope->vertices) most = std::max(most, m.dot(p));
  Vector3d first = Vector3d::Zero();
  int count = 0;
  for (const Vector3d& p : hull.polytope->vertices) {
    if (m.dot(p) < most - kAligned * std::max(0.01, std::abs(most))) continue;
    if (count++ == 0) {
      first = p;
      continue;
    }
    const Vector3d along = (p - first).normalized();
    if (surface.num_flat == 0) {
      surface.num_flat = 1;
      surface.flat = along;
    } else if (std::abs(along.dot(surface.flat)) < kParallel) {
      surface.num_flat = 2;
    }
  }
  return surface;
}

struct Tangent {
  Vector3d e1, e2;
  Vector2d operator()(const Vector3d& v) const { return {e1.dot(v), e2.dot(v)}; }
};

Matrix2d Curvature(const Surface& surface, const Vector2d& flat, const Vector2d& round) {
  Matrix2d C = surface.all_round * Matrix2d::Identity();
  if (surface.num_flat == 2) return kFlat * Matrix2d::Identity();
  if (surface.num_flat == 1) C += kFlat * flat * flat.transpose();
  C += surface.radius * round * round.transpose();
  return C;
}

}  // namespace

double SlidingAcceleration(const geometry::Distance& distance, const geometry::Primitive& a,
                           const math::Pose& X_WA, const PointMotion& motion_a, const geometry::Primitive& b,
                           const math::Pose& X_WB, const PointMotion& motion_b) {
  const Vector3d& n = distance.n_W;
  Tangent tangent;
  const Vector3d& away = std::abs(n.x()) < 0.6 ? Vector3d::UnitX() : Vector3d::UnitY();
  tangent.e1 = n.cross(away).normalized();
  tangent.e2 = n.cross(tangent.e1);
  const auto surface_of = [](const geometry::Primitive& shape, const math::Pose& X, const Vector3d& outward,
                             const Vector3d& p_W) {
    const Vector3d m = X.R.transpose() * outward, p = X.R.transpose() * (p_W - X.p);
    return std::visit([&](const auto& primitive) { return Of(primitive, m, p); }, shape);
  };
  Surface on_a = surface_of(a, X_WA, n, distance.p_WA);
  const Surface on_b = surface_of(b, X_WB, -n, distance.p_WB);
  const Vector2d flat_a = tangent(X_WA.R * on_a.flat), flat_b = tangent(X_WB.R * on_b.flat);
  Matrix2d C_a = Curvature(on_a, flat_a, tangent(X_WA.R * on_a.round));
  const Matrix2d C_b = Curvature(on_b, flat_b, tangent(X_WB.R * on_b.round));
  if (on_a.num_flat == 2 && on_b.num_flat == 1) {
    C_a = kFlat * (Matrix2d::Identity() - flat_b * flat_b.transpose());
  } else if ((on_a.num_flat > 0 && on_b.num_flat == 2) ||
             (on_a.num_flat == 1 && on_b.num_flat == 1 && std::abs(flat_a.dot(flat_b)) > kParallel)) {
    on_a.num_flat = 0;
    C_a = Curvature(on_a, flat_a, tangent(X_WA.R * on_a.round));
  }
  Matrix2d S = C_a + C_b;
  S.diagonal().array() += distance.distance;
  const double mean = 0.5 * S.trace(), half = 0.5 * (S(0, 0) - S(1, 1));
  const double least = mean - std::sqrt(half * half + S(0, 1) * S(0, 1));
  if (least < kLeastRadius) S.diagonal().array() += kLeastRadius - least;
  const Vector2d v = tangent(motion_b.v - motion_a.v);
  const Vector2d w_a = tangent(motion_a.w.cross(n)), w_b = tangent(motion_b.w.cross(n));
  const Vector2d turn = S.inverse() * (v + C_a * w_a + C_b * w_b);
  const Vector2d s_a = C_a * (turn - w_a), s_b = C_b * (w_b - turn);
  return turn.dot(v) - s_b.dot(w_b) + s_a.dot(w_a);
}

}  // namespace tether::control
