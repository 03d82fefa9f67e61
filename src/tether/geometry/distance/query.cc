#include "tether/geometry/distance/query.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>

#include "tether/geometry/distance/core.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/math/infinity.h"

namespace tether::geometry {
namespace {

using Eigen::Vector3d;

/// The part of a line inside a convex solid, with the outward normals at its ends; empty if lower > upper.
struct Span {
  double lower = -math::kInfinity;
  double upper = math::kInfinity;
  Vector3d n_lower = Vector3d::UnitZ();
  Vector3d n_upper = Vector3d::UnitZ();

  bool empty() const { return !(lower <= upper); }
  void Enter(double t, const Vector3d& n) {
    if (t > lower) {
      lower = t;
      n_lower = n;
    }
  }
  void Leave(double t, const Vector3d& n) {
    if (t < upper) {
      upper = t;
      n_upper = n;
    }
  }
  void Clear() {
    lower = 1;
    upper = -1;
  }
};

/// Cuts the span to the slab |x_axis| ≤ half.
void CutSlab(const Vector3d& o, const Vector3d& d, int axis, double half, Span* span) {
  const Vector3d n = Vector3d::Unit(axis);
  if (d[axis] == 0) {
    if (std::abs(o[axis]) > half) span->Clear();
    return;
  }
  const double sign = d[axis] > 0 ? 1 : -1;
  span->Enter((-sign * half - o[axis]) / d[axis], -sign * n);
  span->Leave((sign * half - o[axis]) / d[axis], sign * n);
}

/// Cuts the span to the half space n · x ≤ offset.
void CutHalfSpace(const Vector3d& o, const Vector3d& d, const Vector3d& n, double offset, Span* span) {
  const double rate = n.dot(d);
  const double past = n.dot(o) - offset;
  if (rate == 0) {
    if (past > 0) span->Clear();
  } else if (rate > 0) {
    span->Leave(-past / rate, n);
  } else {
    span->Enter(-past / rate, n);
  }
}

/// The span of the set where |P(o − centre + t d)| ≤ radius, with P the projection on the first `dimension`
/// axes.
Span RoundSpan(Vector3d o, Vector3d d, double radius, int dimension) {
  if (dimension == 2) o.z() = d.z() = 0;
  Span span;
  const double a = d.squaredNorm();
  if (a == 0) {
    if (o.squaredNorm() > radius * radius) span.Clear();
    return span;
  }
  // Measured from the point nearest the centre, which keeps the digits when the origin is far away.
  const double t_near = -o.dot(d) / a;
  const double gap2 = radius * radius - (o + t_near * d).squaredNorm();
  if (gap2 < 0) {
    span.Clear();
    return span;
  }
  const double step = std::sqrt(gap2 / a);
  span.Enter(t_near - step, (o + (t_near - step) * d).normalized());
  span.Leave(t_near + step, (o + (t_near + step) * d).normalized());
  return span;
}

/// The smallest span that covers both; right for pieces of a convex solid.
void Cover(const Span& piece, Span* span) {
  if (piece.empty()) return;
  if (span->empty()) {
    *span = piece;
    return;
  }
  if (piece.lower < span->lower) {
    span->lower = piece.lower;
    span->n_lower = piece.n_lower;
  }
  if (piece.upper > span->upper) {
    span->upper = piece.upper;
    span->n_upper = piece.n_upper;
  }
}

Span SpanInside(const Primitive& solid, const Vector3d& o, const Vector3d& d) {
  if (const auto* box = std::get_if<Box>(&solid)) {
    Span span;
    for (int axis = 0; axis < 3; ++axis) CutSlab(o, d, axis, 0.5 * box->size[axis], &span);
    return span;
  }
  if (const auto* sphere = std::get_if<Sphere>(&solid)) return RoundSpan(o, d, sphere->radius, 3);
  if (const auto* capsule = std::get_if<Capsule>(&solid)) {
    const Vector3d top(0, 0, 0.5 * capsule->length);
    Span span = RoundSpan(o, d, capsule->radius, 2);
    if (!span.empty()) CutSlab(o, d, 2, top.z(), &span);
    Cover(RoundSpan(o - top, d, capsule->radius, 3), &span);
    Cover(RoundSpan(o + top, d, capsule->radius, 3), &span);
    return span;
  }
  if (const auto* hull = std::get_if<Hull>(&solid)) {
    Span span;
    for (const Polytope::Face& face : hull->polytope->faces)
      CutHalfSpace(o, d, face.normal, face.offset, &span);
    return span;
  }
  const auto& cylinder = std::get<Cylinder>(solid);
  Span span = RoundSpan(o, d, cylinder.radius, 2);
  if (!span.empty()) CutSlab(o, d, 2, 0.5 * cylinder.length, &span);
  return span;
}

bool CanHit(const Vector3d& origin, const Vector3d& direction) {
  return origin.allFinite() && direction.allFinite() && direction.squaredNorm() > 0;
}

}  // namespace

PointDistance DistanceToPoint(const Primitive& solid, const math::Pose& X_WS, const Vector3d& p_WQ) {
  const internal::Core core = internal::MakeCore(solid);
  const Vector3d q = X_WS.R.transpose() * (p_WQ - X_WS.p);
  const Vector3d up = X_WS.R.row(2).transpose();
  internal::Foot foot;
  switch (core.kind) {
    case internal::Core::Kind::kPoint:
    case internal::Core::Kind::kSegment: {
      foot.p = Vector3d(0, 0, std::clamp(q.z(), -core.half.z(), core.half.z()));
      foot.distance = (q - foot.p).norm();
      foot.n =
          foot.distance > 1e-12 ? Vector3d((q - foot.p) / foot.distance) : internal::UpAcross(core.half, up);
      break;
    }
    case internal::Core::Kind::kBox:
      foot = internal::FootOnBox(core.half, q, up);
      break;
    case internal::Core::Kind::kHull:
      foot = internal::FootOnHull(*core.hull, q, up);
      break;
    case internal::Core::Kind::kCylinder:
      foot = internal::FootOnCylinder(core.disc, core.half.z(), q, up);
      break;
  }
  return {foot.distance - core.rounding, X_WS * (foot.p + core.rounding * foot.n), X_WS.R * foot.n, 0};
}

PointDistance DistanceToPoint(const Shape& solid, const math::Pose& X_WS, const Vector3d& p_WQ) {
  assert(!solid.parts.empty());
  PointDistance least;
  for (size_t i = 0; i < solid.parts.size(); ++i) {
    PointDistance distance = DistanceToPoint(solid.parts[i].primitive, X_WS * solid.parts[i].X_SP, p_WQ);
    distance.part = static_cast<int>(i);
    if (i == 0 || distance.distance < least.distance) least = distance;
  }
  return least;
}

PointDistanceDerivative DifferentiatePointDistance(const PointDistance& distance, const math::Pose& X_WS) {
  const Vector3d n = X_WS.R.transpose() * distance.n_W;
  const Vector3d arm = X_WS.R.transpose() * (distance.p_W - X_WS.p);
  PointDistanceDerivative derivative;
  derivative.dQ = distance.n_W.transpose();
  derivative.dS << -n.transpose(), -arm.cross(n).transpose();
  return derivative;
}

std::optional<RayHit> CastRay(const Primitive& solid, const math::Pose& X_WS, const Vector3d& origin_W,
                              const Vector3d& direction_W, RayStart start, double t_max) {
  if (!CanHit(origin_W, direction_W)) return std::nullopt;
  const Vector3d o = X_WS.R.transpose() * (origin_W - X_WS.p);
  const Vector3d d = X_WS.R.transpose() * direction_W;
  const Span span = SpanInside(solid, o, d);
  if (span.empty() || span.upper < 0) return std::nullopt;
  RayHit hit;
  hit.from_inside = span.lower < 0;
  if (hit.from_inside && start == RayStart::kIgnore) return std::nullopt;
  hit.t = hit.from_inside ? span.upper : span.lower;
  if (hit.t > t_max) return std::nullopt;
  hit.p_W = origin_W + hit.t * direction_W;
  hit.n_W = X_WS.R * (hit.from_inside ? span.n_upper : span.n_lower);
  return hit;
}

std::optional<RayHit> CastRay(const Shape& solid, const math::Pose& X_WS, const Vector3d& origin_W,
                              const Vector3d& direction_W, RayStart start, double t_max) {
  if (!CanHit(origin_W, direction_W)) return std::nullopt;
  std::optional<RayHit> first;
  double inside_until = 0;
  bool inside = false;
  // Each pass extends the stretch inside the union by one more part, so as many passes as parts suffice.
  for (size_t pass = 0; pass < solid.parts.size(); ++pass) {
    bool extended = false;
    for (size_t i = 0; i < solid.parts.size(); ++i) {
      const math::Pose X_WP = X_WS * solid.parts[i].X_SP;
      const Vector3d o = X_WP.R.transpose() * (origin_W - X_WP.p);
      const Vector3d d = X_WP.R.transpose() * direction_W;
      const Span span = SpanInside(solid.parts[i].primitive, o, d);
      if (span.empty() || span.upper < 0) continue;
      if (span.lower < 0 || (inside && span.lower <= inside_until)) {
        if (start == RayStart::kIgnore) return std::nullopt;
        if (inside && span.upper <= inside_until) continue;
        inside = extended = true;
        inside_until = span.upper;
        first = RayHit{span.upper, origin_W + span.upper * direction_W, X_WP.R * span.n_upper,
                       static_cast<int>(i), true};
      } else if (!inside && (!first || span.lower < first->t)) {
        first = RayHit{span.lower, origin_W + span.lower * direction_W, X_WP.R * span.n_lower,
                       static_cast<int>(i), false};
      }
    }
    if (!extended) break;
  }
  if (first && first->t > t_max) return std::nullopt;
  return first;
}

}  // namespace tether::geometry
