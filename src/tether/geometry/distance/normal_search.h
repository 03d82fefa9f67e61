#pragma once

#include "tether/geometry/distance/core.h"

/// Searches for the normal of greatest separation where one of the solids is round; not for use outside this
/// room.
namespace tether::geometry::internal {

/// The root of f in [lower, upper], where f(lower) ≤ 0 ≤ f(upper) (Illinois: regula falsi that halves the
/// weight of an end that stays). Stops at 1e-13 of the unit.
template <class F>
double FindRoot(const F& f, double lower, double f_lower, double upper, double f_upper) {
  for (int i = 0; i < 80 && upper - lower > 1e-13; ++i) {
    const double gain = f_upper - f_lower;
    double x = gain > 0 ? lower - f_lower * (upper - lower) / gain : 0.5 * (lower + upper);
    if (i % 8 == 7 || !(x > lower && x < upper)) x = 0.5 * (lower + upper);
    const double value = f(x);
    if (value == 0) return x;
    if (value < 0) {
      lower = x;
      f_lower = value;
      f_upper *= 0.5;
    } else {
      upper = x;
      f_upper = value;
      f_lower *= 0.5;
    }
  }
  return 0.5 * (lower + upper);
}

/// Tries the unit normals across `axis`. They belong to the ruled pieces of the Minkowski difference: a
/// straight edge along `axis` against a rim, or a cylinder's side.
void TryCircle(const Query& query, const Eigen::Vector3d& axis, BestNormal* best);

/// Tries the unit normals on the shorter arc from one to another, as those of an edge between two faces.
void TryArc(const Query& query, const Eigen::Vector3d& from, const Eigen::Vector3d& to, BestNormal* best);

/// Tries all normals of two cylinders for rim against rim, whose Minkowski difference is curved in both
/// directions. The caller tries those across one of the axes, where the rims change.
void TryRims(const Query& query, BestNormal* best);

/// An upper bound of the separation on the arc between two unit normals `turn` rad apart, less than π, from
/// the support differences g at either end. Where g · n is negative it is convex in the angle, so that chords
/// bound it; elsewhere it rises above its chord by at most its greatest value times turn² / 8.
double BoundOnArc(const Eigen::Vector3d& n_a, const Eigen::Vector3d& g_a, const Eigen::Vector3d& n_b,
                  const Eigen::Vector3d& g_b, double turn);

}  // namespace tether::geometry::internal
