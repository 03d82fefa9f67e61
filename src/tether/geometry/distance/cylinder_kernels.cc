#include <algorithm>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

#include "tether/geometry/distance/core.h"
#include "tether/geometry/distance/gjk.h"
#include "tether/geometry/distance/normal_search.h"
#include "tether/math/infinity.h"

namespace tether::geometry::internal {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

/// Below this the difference of two witness points does not define the normal accurately, m.
constexpr double kTouching = 1e-8;
/// Witness points found iteratively lie this near to the features of their normal, m.
constexpr double kMiss = 1e-9;

Gap FromPoints(const Vector3d& p_A, const Vector3d& p_B) {
  const double distance = (p_B - p_A).norm();
  return {distance, p_A, p_B, (p_B - p_A) / distance};
}

/// Whether nearest points found on some edges are those of the solids: all edges may stay clear although one
/// solid pierces a face of the other, so the normal must tell them apart. If so, `gap` is completed.
bool TellsApart(const Query& query, double nearest2, Gap* gap) {
  if (!(nearest2 > kTouching * kTouching)) return false;
  const Gap apart = FromPoints(gap->p_A, gap->p_B);
  if (!(query.Separation(apart.n) > 0)) return false;
  *gap = apart;
  return true;
}

/// The point of the rim with the given centre (in the frame of the cylinder `core`) that is nearest to the
/// cylinder; none where all are beyond a given distance.
struct RimPoint {
  Vector3d p = Vector3d::Zero();
  double distance2 = math::kInfinity;
};
RimPoint NearestOnRim(const Vector3d& centre, const Vector3d& axis, double rim_radius, const Core& core,
                      double beyond2) {
  constexpr int kSamples = 16;
  // No point of an arc is nearer than one of its ends less its length.
  const auto may_be_nearer = [&](double distance2, double arc, double than2) {
    const double lower = std::sqrt(distance2) - arc;
    return lower <= 0 || lower * lower < than2;
  };
  const Vector3d to_centre = centre - NearestOfCylinder(core.disc, core.half.z(), centre);
  if (!may_be_nearer(to_centre.squaredNorm(), rim_radius, beyond2)) return {};
  const Vector3d u = axis.unitOrthogonal();
  const Vector3d v = axis.cross(u);
  const auto point = [&](double angle) {
    return Vector3d(centre + rim_radius * (std::cos(angle) * u + std::sin(angle) * v));
  };
  const auto excess = [&](const Vector3d& q) {
    return Vector3d(q - NearestOfCylinder(core.disc, core.half.z(), q));
  };
  const auto slope = [&](double angle) {
    return excess(point(angle)).dot(std::cos(angle) * v - std::sin(angle) * u);
  };
  std::array<double, kSamples> value;
  const double step = 2 * pi / kSamples;
  for (int i = 0; i < kSamples; ++i) value[i] = excess(point(i * step)).squaredNorm();
  RimPoint nearest;
  for (int i = 0; i < kSamples; ++i) {
    if (value[i] > value[(i + 1) % kSamples] || value[i] > value[(i + kSamples - 1) % kSamples]) continue;
    if (!may_be_nearer(value[i], rim_radius * step, std::min(beyond2, nearest.distance2))) continue;
    const double lower = (i - 1) * step;
    const double upper = (i + 1) * step;
    const double f_lower = slope(lower);
    const double f_upper = slope(upper);
    double angle = i * step;
    if (f_lower <= 0 && f_upper >= 0) angle = FindRoot(slope, lower, f_lower, upper, f_upper);
    const Vector3d p = point(angle);
    const double distance2 = excess(p).squaredNorm();
    if (distance2 < nearest.distance2) nearest = {p, distance2};
  }
  return nearest;
}

void TryCaps(const Eigen::Matrix3d& R, BestNormal* best) { best->TryBoth(R.col(2), 0); }

}  // namespace

Foot FootOnCylinder(double radius, double half, const Vector3d& q, const Vector3d& up) {
  const double across = std::hypot(q.x(), q.y());
  const double past_side = across - radius;
  const double past_cap = std::abs(q.z()) - half;
  if (past_side > 0 && past_cap > 0) {
    Foot foot;
    foot.p = NearestOfCylinder(radius, half, q);
    foot.distance = (q - foot.p).norm();
    if (foot.distance > 1e-12) {
      foot.n = (q - foot.p) / foot.distance;
      return foot;
    }
  }
  const Vector3d radial =
      across > 1e-12 ? Vector3d(q.x() / across, q.y() / across, 0) : UpAcross(Vector3d::UnitZ(), up);
  const bool at_middle = std::abs(q.z()) <= kTie;
  const Vector3d cap(0, 0, (at_middle ? up.z() : q.z()) >= 0 ? 1 : -1);
  Foot foot;
  const bool tied = std::abs(past_cap - past_side) <= kTie;
  const bool by_cap = tied ? cap.dot(up) >= radial.dot(up) - 1e-9 : past_cap > past_side;
  foot.distance = by_cap ? past_cap : past_side;
  foot.n = by_cap ? cap : radial;
  foot.p = q - foot.distance * foot.n;
  return foot;
}

double NearestParameterToCylinder(double radius, double half, const Vector3d& p, Vector3d d) {
  const double length = d.norm();
  if (std::hypot(d.x(), d.y()) <= kParallel * length) {
    d.x() = d.y() = 0;
    double lower = (-half - p.z()) / d.z();
    double upper = (half - p.z()) / d.z();
    if (lower > upper) std::swap(lower, upper);
    lower = std::max(lower, 0.0);
    upper = std::min(upper, 1.0);
    if (lower <= upper) return 0.5 * (lower + upper);
  } else if (std::abs(d.z()) <= kParallel * length) {
    d.z() = 0;
    const double a = d.x() * d.x() + d.y() * d.y();
    const double b = p.x() * d.x() + p.y() * d.y();
    const double c = p.x() * p.x() + p.y() * p.y() - radius * radius;
    const double root2 = b * b - a * c;
    if (root2 > 0) {
      const double lower = std::max(0.0, (-b - std::sqrt(root2)) / a);
      const double upper = std::min(1.0, (-b + std::sqrt(root2)) / a);
      if (lower <= upper) return 0.5 * (lower + upper);
    }
  }
  const auto slope = [&](double t) {
    const Vector3d q = p + t * d;
    return d.dot(q - NearestOfCylinder(radius, half, q));
  };
  const double slope_0 = slope(0);
  if (slope_0 >= 0) return 0;
  const double slope_1 = slope(1);
  if (slope_1 <= 0) return 1;
  return FindRoot(slope, 0, slope_0, 1, slope_1);
}

Gap PointCylinder(const Query& query) {
  const Eigen::Matrix3d& R = query.X_AB.R;
  const Foot foot = FootOnCylinder(query.b.disc, query.b.half.z(), -(R.transpose() * query.X_AB.p),
                                   -(R.transpose() * query.up_A));
  return {foot.distance, Vector3d::Zero(), query.X_AB * foot.p, -(R * foot.n)};
}

Gap SegmentCylinder(const Query& query) {
  const Eigen::Matrix3d& R = query.X_AB.R;
  const double half = query.a.half.z();
  const Vector3d start = R.transpose() * (Vector3d(0, 0, -half) - query.X_AB.p);
  const Vector3d along = 2 * half * R.row(2).transpose();
  const double t = NearestParameterToCylinder(query.b.disc, query.b.half.z(), start, along);
  const Vector3d p_A(0, 0, half * (2 * t - 1));
  const Vector3d p_B = query.X_AB * NearestOfCylinder(query.b.disc, query.b.half.z(), start + t * along);
  if ((p_B - p_A).norm() > kTouching) return FromPoints(p_A, p_B);

  BestNormal best(query);
  TryCaps(R, &best);
  const Vector3d axis = R.col(2);
  const Vector3d crossed = axis.cross(Vector3d::UnitZ());
  if (crossed.norm() > 10 * kParallel) best.TryBoth(crossed.normalized(), 1);
  for (const double end : {-half, half}) {
    const Vector3d to_axis = query.X_AB.p - Vector3d(0, 0, end);
    const Vector3d across = to_axis - to_axis.dot(axis) * axis;
    if (across.norm() > 1e-12) best.TryBoth(across.normalized(), 1);
  }
  best.Try(UpAcross(axis, query.up_A), 1);
  TryCircle(query, Vector3d::UnitZ(), &best);
  Gap gap;
  WitnessPointsAlong(query, best.n(), &gap);
  return gap;
}

namespace {

/// The cylinder's witness point on a box's edge, for solids that are apart; false where it is not certain.
bool ApartAtEdge(const Query& query, Gap* gap) {
  const Eigen::Matrix3d& R = query.X_AB.R;
  const Vector3d& half = query.a.half;
  double nearest2 = math::kInfinity;
  for (int axis = 0; axis < 3; ++axis) {
    const int j = (axis + 1) % 3;
    const int k = (axis + 2) % 3;
    const Vector3d along_B = 2 * half[axis] * R.row(axis).transpose();
    for (int corner = 0; corner < 4; ++corner) {
      Vector3d start;
      start[axis] = -half[axis];
      start[j] = corner & 1 ? half[j] : -half[j];
      start[k] = corner & 2 ? half[k] : -half[k];
      const Vector3d start_B = R.transpose() * (start - query.X_AB.p);
      const Vector3d middle_B = start_B + 0.5 * along_B;
      const double bound =
          (middle_B - NearestOfCylinder(query.b.disc, query.b.half.z(), middle_B)).norm() - half[axis];
      if (bound > 0 && bound * bound >= nearest2) continue;
      const double t = NearestParameterToCylinder(query.b.disc, query.b.half.z(), start_B, along_B);
      const Vector3d q_B = start_B + t * along_B;
      const Vector3d foot_B = NearestOfCylinder(query.b.disc, query.b.half.z(), q_B);
      const double distance2 = (q_B - foot_B).squaredNorm();
      if (distance2 >= nearest2) continue;
      nearest2 = distance2;
      gap->p_A = start + 2 * t * half[axis] * Vector3d::Unit(axis);
      gap->p_B = query.X_AB * foot_B;
    }
  }
  return TellsApart(query, nearest2, gap);
}

}  // namespace

Gap BoxCylinder(const Query& query) {
  const Eigen::Matrix3d& R = query.X_AB.R;
  BestNormal best(query);
  for (int axis = 0; axis < 3; ++axis) best.TryBoth(Vector3d::Unit(axis), 0);
  TryCaps(R, &best);
  Gap gap;
  const double miss = WitnessPointsAlong(query, best.n(), &gap);
  if (gap.distance > 0 && miss <= kMiss) return gap;
  // Apart, with no witness inside a face: then the box's lies on one of its edges.
  if ((gap.distance > 0 || !SurelyOverlap(query)) && ApartAtEdge(query, &gap)) return gap;

  const Vector3d axis_B = R.col(2);
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d crossed = axis_B.cross(Vector3d::Unit(axis));
    if (crossed.norm() > 10 * kParallel) best.TryBoth(crossed.normalized(), 1);
    TryCircle(query, Vector3d::Unit(axis), &best);
  }
  TryCircle(query, axis_B, &best);
  WitnessPointsAlong(query, best.n(), &gap);
  return gap;
}

namespace {

/// A witness point on a rim of either, for solids that are apart; false where it is not certain.
bool ApartAtRim(const Query& query, Gap* gap) {
  const Eigen::Matrix3d& R = query.X_AB.R;
  const Vector3d axis_B = R.col(2);
  double nearest2 = math::kInfinity;
  // The ends that face the other solid first: they rule out most of the rest.
  const double facing_A = query.X_AB.p.z() >= 0 ? 1 : -1, facing_B = query.X_AB.p.dot(axis_B) >= 0 ? -1 : 1;
  for (const double side : {1.0, -1.0}) {
    const Vector3d centre_A(0, 0, side * facing_A * query.a.half.z());
    const RimPoint on_a = NearestOnRim(R.transpose() * (centre_A - query.X_AB.p), R.transpose().col(2),
                                       query.a.disc, query.b, nearest2);
    if (on_a.distance2 < nearest2) {
      nearest2 = on_a.distance2;
      gap->p_A = query.X_AB * on_a.p;
      gap->p_B = query.X_AB * NearestOfCylinder(query.b.disc, query.b.half.z(), on_a.p);
    }
    const RimPoint on_b = NearestOnRim(query.X_AB.p + side * facing_B * query.b.half.z() * axis_B, axis_B,
                                       query.b.disc, query.a, nearest2);
    if (on_b.distance2 < nearest2) {
      nearest2 = on_b.distance2;
      gap->p_B = on_b.p;
      gap->p_A = NearestOfCylinder(query.a.disc, query.a.half.z(), on_b.p);
    }
  }
  return TellsApart(query, nearest2, gap);
}

}  // namespace

Gap CylinderCylinder(const Query& query) {
  const Eigen::Matrix3d& R = query.X_AB.R;
  const Vector3d axis_B = R.col(2);
  BestNormal best(query);
  TryCaps(Eigen::Matrix3d::Identity(), &best);
  TryCaps(R, &best);
  const Vector3d crossed = Vector3d::UnitZ().cross(axis_B);
  if (crossed.norm() > 10 * kParallel) {
    best.TryBoth(crossed.normalized(), 1);
  } else {
    const Vector3d across(query.X_AB.p.x(), query.X_AB.p.y(), 0);
    if (across.norm() > 1e-12) best.Try(across.normalized(), 1);
  }
  Gap gap;
  const double miss = WitnessPointsAlong(query, best.n(), &gap);
  if (gap.distance > 0 && miss <= kMiss) return gap;

  // Apart, with no witness inside a cap and not side to side: then a witness lies on a rim.
  if ((gap.distance > 0 || !SurelyOverlap(query)) && ApartAtRim(query, &gap)) return gap;
  TryCircle(query, Vector3d::UnitZ(), &best);
  TryCircle(query, axis_B, &best);
  TryRims(query, &best);
  WitnessPointsAlong(query, best.n(), &gap);
  return gap;
}

}  // namespace tether::geometry::internal
