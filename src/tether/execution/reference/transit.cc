#include "tether/execution/reference/transit.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tether::execution {
namespace {

// This near above the goal (m, rad) the motion leads down, whatever stands beside it.
constexpr double kAboveGoal = 0.01;
constexpr double kTurned = 0.1;
// This far below the safe height the motion leads across already, m.
constexpr double kRisen = 0.01;
// Up to this far beside its line (m) the approach goes on; beyond, it starts again this many times the excess
// before the goal.
constexpr double kBeside = 0.01;
constexpr double kFunnelSlope = 2;

// The part [*from, *to] of s ∈ [0, 1] in which a + s (b − a) lies inside (lower, upper); false if there is
// none.
bool Clip(double a, double b, double lower, double upper, double* from, double* to) {
  const double d = b - a;
  if (std::abs(d) < 1e-12) return a > lower && a < upper;
  double s0 = (lower - a) / d;
  double s1 = (upper - a) / d;
  if (s0 > s1) std::swap(s0, s1);
  *from = std::max(*from, s0);
  *to = std::min(*to, s1);
  return *from <= *to;
}

}  // namespace

Passage CheckPassage(const std::vector<geometry::Aabb>& body, const Eigen::Vector3d& p_from,
                     const Eigen::Vector3d& p_to, const std::vector<geometry::Aabb>& obstacles,
                     const TransitMargins& margins, double ceiling) {
  Passage passage;
  for (const geometry::Aabb& part : body) {
    for (const geometry::Aabb& obstacle : obstacles) {
      const double needed = obstacle.upper.z() + margins.above - part.lower.z();
      if (needed > ceiling || (passage.blocked && needed <= passage.height)) continue;
      double from = 0;
      double to = 1;
      bool meets = true;
      for (int axis = 0; axis < 2 && meets; ++axis) {
        meets = Clip(p_from[axis], p_to[axis], obstacle.lower[axis] - part.upper[axis] - margins.side,
                     obstacle.upper[axis] - part.lower[axis] + margins.side, &from, &to);
      }
      if (!meets) continue;
      const double z0 = p_from.z() + from * (p_to.z() - p_from.z());
      const double z1 = p_from.z() + to * (p_to.z() - p_from.z());
      if (std::min(z0, z1) >= needed) continue;
      if (std::max(z0, z1) + part.upper.z() + margins.above < obstacle.lower.z()) continue;
      passage.blocked = true;
      passage.height = needed;
    }
  }
  return passage;
}

math::Pose TransitWaypoint(const Passage& passage, const math::Pose& X_WR, const math::Pose& X_WG) {
  if (!passage.blocked) return X_WG;
  const bool above_goal = (X_WG.p - X_WR.p).head<2>().norm() < kAboveGoal &&
                          math::AngleBetween(X_WG.R, X_WR.R) < kTurned &&
                          X_WR.p.z() > X_WG.p.z() - kAboveGoal;
  if (above_goal) return X_WG;
  const double height = std::max(passage.height, X_WG.p.z());
  if (X_WR.p.z() < height - kRisen) {
    return {X_WR.R, Eigen::Vector3d(X_WR.p.x(), X_WR.p.y(), height)};
  }
  return {X_WG.R, Eigen::Vector3d(X_WG.p.x(), X_WG.p.y(), height)};
}

math::Pose DrawWithin(const math::Pose& X_WH, const Eigen::Vector3d& p_HQ, const Eigen::Vector3d& p_WCentre,
                      double radius) {
  const Eigen::Vector3d from_centre = X_WH * p_HQ - p_WCentre;
  const double beyond = from_centre.norm() - radius;
  if (beyond <= 0) return X_WH;
  return {X_WH.R, X_WH.p - beyond * from_centre.normalized()};
}

math::Pose FunnelWaypoint(const math::Pose& X_TG, const Eigen::Vector3d& direction, double length,
                          const math::Pose& X_TR, const math::Pose& X_TH) {
  const Eigen::Vector3d offset = X_TH.p - X_TG.p;
  const double beside =
      (offset - direction * direction.dot(offset)).norm() + 0.1 * math::AngleBetween(X_TH.R, X_TG.R);
  const double back = std::clamp(kFunnelSlope * (beside - kBeside), 0.0, length);
  if (back == 0) return X_TG;
  const double before = -(X_TR.p - X_TG.p).dot(direction);
  if (before < back - kRisen) return {X_TR.R, X_TR.p - direction * (back - before)};
  return {X_TG.R, X_TG.p - direction * back};
}

}  // namespace tether::execution
