#include <algorithm>
#include <utility>

#include <Eigen/Geometry>

#include "tether/geometry/distance/core.h"
#include "tether/math/infinity.h"

namespace tether::geometry::internal {
namespace {

using Eigen::Vector3d;

/// Below this the difference of two witness points does not define the normal accurately, m.
constexpr double kTouching = 1e-9;

Gap FromPoints(const Vector3d& p_A, const Vector3d& p_B, double distance) {
  return {distance, p_A, p_B, (p_B - p_A) / distance};
}

/// Tries the six face normals of core `core` placed with rotation R.
void TryFaces(const Core& core, const Eigen::Matrix3d& R, BestNormal* best) {
  for (int axis = 0; axis < 3; ++axis) {
    // A side of zero length has no face, but its normal still bounds the distance; rank it as an edge's.
    best->TryBoth(R.col(axis), core.half[axis] > 0 ? 0 : 1);
  }
}

void TryEdges(const Core& a, const Core& b, const Eigen::Matrix3d& R, BestNormal* best) {
  for (int i = 0; i < 3; ++i) {
    if (a.half[i] <= 0) continue;
    for (int j = 0; j < 3; ++j) {
      if (b.half[j] <= 0) continue;
      const Vector3d n = Vector3d::Unit(i).cross(R.col(j));
      const double sine = n.norm();
      if (sine > 10 * kParallel) best->TryBoth(n / sine, 1);
    }
  }
}

Vector3d ClampToBox(const Vector3d& half, const Vector3d& q) { return q.cwiseMax(-half).cwiseMin(half); }

}  // namespace

Foot FootOnBox(const Vector3d& half, const Vector3d& q, const Vector3d& up) {
  const Vector3d clamped = ClampToBox(half, q);
  const double outside = (q - clamped).norm();
  if (outside > kTouching) return {outside, clamped, (q - clamped) / outside};
  Foot foot;
  foot.distance = -math::kInfinity;
  double best_up = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      const double distance = sign * q[axis] - half[axis];
      const double n_up = sign * up[axis];
      if (distance < foot.distance - kTie) continue;
      if (distance <= foot.distance + kTie && n_up <= best_up + 1e-9) continue;
      foot.distance = distance;
      foot.n = sign * Vector3d::Unit(axis);
      best_up = n_up;
    }
  }
  foot.p = q - foot.distance * foot.n;
  return foot;
}

double NearestParameterToBox(const Vector3d& half, const Vector3d& p, Vector3d d) {
  // Half the squared distance along the segment is convex and piecewise quadratic; find where its slope
  // vanishes.
  const double length = d.norm();
  for (int i = 0; i < 3; ++i) {
    if (std::abs(d[i]) <= kParallel * length) d[i] = 0;
  }
  const auto slope = [&](double t) {
    const Vector3d x = p + t * d;
    return d.dot(x - ClampToBox(half, x));
  };
  std::array<double, 8> knots;
  int count = 0;
  knots[count++] = 0;
  for (int i = 0; i < 3; ++i) {
    if (d[i] == 0) continue;
    for (const double face : {-half[i], half[i]}) {
      const double t = (face - p[i]) / d[i];
      if (t > 0 && t < 1) knots[count++] = t;
    }
  }
  knots[count++] = 1;
  for (int i = 1; i < count; ++i) {
    for (int j = i; j > 0 && knots[j] < knots[j - 1]; --j) std::swap(knots[j], knots[j - 1]);
  }
  const double flat = 1e-14 * length * (length + p.norm());
  double slope_before = slope(0);
  if (slope_before > flat) return 0;
  double lower = slope_before >= -flat ? 0.0 : -1.0;
  double upper = lower;
  for (int k = 1; k < count; ++k) {
    const double here = slope(knots[k]);
    if (here >= -flat && lower < 0) {
      const double step = here - slope_before;
      lower = here <= flat
                  ? knots[k]
                  : knots[k - 1] + (knots[k] - knots[k - 1]) * std::clamp(-slope_before / step, 0.0, 1.0);
      upper = lower;
    }
    if (here > flat) break;
    if (here >= -flat) upper = knots[k];
    slope_before = here;
  }
  return lower < 0 ? 1.0 : 0.5 * (lower + upper);
}

Gap PointPoint(const Query& query) {
  const double distance = query.X_AB.p.norm();
  Gap gap;
  gap.distance = distance;
  gap.p_B = query.X_AB.p;
  gap.n = distance > 1e-12 ? Vector3d(query.X_AB.p / distance) : query.up_A;
  return gap;
}

Gap PointSegment(const Query& query) {
  const Vector3d axis = query.X_AB.R.col(2);
  const double half = query.b.half.z();
  const Vector3d p_B = query.X_AB.p + std::clamp(-axis.dot(query.X_AB.p), -half, half) * axis;
  const double distance = p_B.norm();
  if (distance > 1e-12) return FromPoints(Vector3d::Zero(), p_B, distance);
  return {0, Vector3d::Zero(), Vector3d::Zero(), UpAcross(axis, query.up_A)};
}

Gap SegmentSegment(const Query& query) {
  const Vector3d axis = query.X_AB.R.col(2);
  const Vector3d& c = query.X_AB.p;
  const double half_a = query.a.half.z();
  const double half_b = query.b.half.z();
  const double cosine = axis.z();
  const double sine2 = axis.x() * axis.x() + axis.y() * axis.y();
  // Points s ẑ and c + t axis.
  const double c_axis = c.dot(axis);
  double s, t;
  if (sine2 <= kParallel * kParallel) {
    const double lower = std::max(-half_a, c.z() - half_b);
    const double upper = std::min(half_a, c.z() + half_b);
    s = lower <= upper ? 0.5 * (lower + upper) : (c.z() > 0 ? half_a : -half_a);
    t = std::clamp(s * cosine - c_axis, -half_b, half_b);
  } else {
    s = std::clamp((c.z() - cosine * c_axis) / sine2, -half_a, half_a);
    t = s * cosine - c_axis;
    if (t < -half_b || t > half_b) {
      t = std::clamp(t, -half_b, half_b);
      s = std::clamp(c.z() + t * cosine, -half_a, half_a);
    }
  }
  const Vector3d p_A(0, 0, s);
  const Vector3d p_B = c + t * axis;
  const double distance = (p_B - p_A).norm();
  if (distance > 1e-10) return FromPoints(p_A, p_B, distance);
  Gap gap{0, p_A, p_A, UpAcross(Vector3d::UnitZ(), query.up_A)};
  if (sine2 > kParallel * kParallel) {
    gap.n = Vector3d::UnitZ().cross(axis).normalized();
    if (gap.n.dot(query.up_A) < 0) gap.n = -gap.n;
  }
  return gap;
}

Gap PointBox(const Query& query) {
  const Foot foot = FootOnBox(query.b.half, -(query.X_AB.R.transpose() * query.X_AB.p),
                              -(query.X_AB.R.transpose() * query.up_A));
  return {foot.distance, Vector3d::Zero(), query.X_AB * foot.p, -(query.X_AB.R * foot.n)};
}

Gap SegmentBox(const Query& query) {
  const Eigen::Matrix3d& R = query.X_AB.R;
  const double half = query.a.half.z();
  const Vector3d start = R.transpose() * (Vector3d(0, 0, -half) - query.X_AB.p);
  const Vector3d along = 2 * half * R.row(2).transpose();
  const double t = NearestParameterToBox(query.b.half, start, along);
  const Vector3d p_A(0, 0, half * (2 * t - 1));
  const Vector3d p_B = query.X_AB * ClampToBox(query.b.half, start + t * along);
  const double distance = (p_B - p_A).norm();
  if (distance > kTouching) return FromPoints(p_A, p_B, distance);
  BestNormal best(query);
  TryFaces(query.b, R, &best);
  TryEdges(query.a, query.b, R, &best);
  Gap gap;
  WitnessPointsAlong(query, best.n(), &gap);
  return gap;
}

Gap BoxBox(const Query& query) {
  const Eigen::Matrix3d& R = query.X_AB.R;
  const Vector3d& c = query.X_AB.p;
  const Vector3d& half_a = query.a.half;
  const Vector3d& half_b = query.b.half;
  BestNormal best(query);
  TryFaces(query.a, Eigen::Matrix3d::Identity(), &best);
  TryFaces(query.b, R, &best);
  TryEdges(query.a, query.b, R, &best);
  Gap gap;
  const double miss = WitnessPointsAlong(query, best.n(), &gap);
  if (gap.distance <= kTouching || miss <= 1e-9) return gap;

  // Apart, with neither witness inside a face: then A's lies on an edge of A.
  double nearest2 = math::kInfinity;
  for (int axis = 0; axis < 3; ++axis) {
    const int j = (axis + 1) % 3;
    const int k = (axis + 2) % 3;
    const Vector3d along_B = 2 * half_a[axis] * R.row(axis).transpose();
    for (int corner = 0; corner < 4; ++corner) {
      Vector3d start;
      start[axis] = -half_a[axis];
      start[j] = corner & 1 ? half_a[j] : -half_a[j];
      start[k] = corner & 2 ? half_a[k] : -half_a[k];
      const Vector3d start_B = R.transpose() * (start - c);
      const Vector3d middle_B = start_B + 0.5 * along_B;
      const double bound = (middle_B - ClampToBox(half_b, middle_B)).norm() - half_a[axis];
      if (bound > 0 && bound * bound >= nearest2) continue;
      const double t = NearestParameterToBox(half_b, start_B, along_B);
      const Vector3d q_B = start_B + t * along_B;
      const Vector3d foot_B = ClampToBox(half_b, q_B);
      const double distance2 = (q_B - foot_B).squaredNorm();
      if (distance2 >= nearest2) continue;
      nearest2 = distance2;
      gap.p_A = start + 2 * t * half_a[axis] * Vector3d::Unit(axis);
      gap.p_B = query.X_AB * foot_B;
    }
  }
  return FromPoints(gap.p_A, gap.p_B, (gap.p_B - gap.p_A).norm());
}

}  // namespace tether::geometry::internal
