#include "tether/geometry/distance/gjk.h"

#include <algorithm>
#include <array>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "tether/math/infinity.h"

namespace tether::geometry::internal {
namespace {

using Eigen::Vector3d;

constexpr int kMostSteps = 200;
constexpr double kTouching = 1e-9;

/// A point of the Minkowski difference B − A, with the points that it is the difference of.
struct Corner {
  Vector3d w, p_A, p_B;
  double weight = 0;
};

struct Simplex {
  std::array<Corner, 4> corners;
  int size = 0;
};

/// Weights of the point of the affine hull of the corners in `subset` that is nearest to the origin; false if
/// it is not inside their convex hull.
bool Weigh(const Simplex& simplex, const std::array<int, 4>& subset, int count,
           std::array<double, 4>* weights) {
  const Vector3d& o = simplex.corners[subset[0]].w;
  if (count == 1) {
    (*weights)[0] = 1;
    return true;
  }
  const Vector3d a = simplex.corners[subset[1]].w - o;
  if (count == 2) {
    const double length2 = a.squaredNorm();
    const double t = -o.dot(a) / length2;
    *weights = {1 - t, t, 0, 0};
    return length2 > 0 && t > 0 && t < 1;
  }
  const Vector3d b = simplex.corners[subset[2]].w - o;
  const Vector3d n = a.cross(b);
  if (count == 3) {
    const double area2 = n.squaredNorm();
    if (!(area2 > 1e-28 * a.squaredNorm() * b.squaredNorm())) return false;
    const double s = n.dot(b.cross(o)) / area2;
    const double t = n.dot(o.cross(a)) / area2;
    *weights = {1 - s - t, s, t, 0};
    return s > 0 && t > 0 && s + t < 1;
  }
  const Vector3d c = simplex.corners[subset[3]].w - o;
  const double volume = n.dot(c);
  if (!(std::abs(volume) > 1e-14 * n.norm() * c.norm())) return false;
  const double r = -o.dot(b.cross(c)) / volume;
  const double s = -o.dot(c.cross(a)) / volume;
  const double t = -o.dot(n) / volume;
  *weights = {1 - r - s - t, r, s, t};
  return r > 0 && s > 0 && t > 0 && r + s + t < 1;
}

/// Reduces the simplex to the smallest face with its point nearest to the origin; returns that point.
Vector3d Reduce(Simplex* simplex) {
  double least = math::kInfinity;
  Simplex best;
  Vector3d nearest = Vector3d::Zero();
  for (int mask = 1; mask < (1 << simplex->size); ++mask) {
    std::array<int, 4> subset{};
    int count = 0;
    for (int i = 0; i < simplex->size; ++i) {
      if (mask >> i & 1) subset[count++] = i;
    }
    std::array<double, 4> weights{};
    if (!Weigh(*simplex, subset, count, &weights)) continue;
    Vector3d v = Vector3d::Zero();
    if (count < 4) {
      for (int i = 0; i < count; ++i) v += weights[i] * simplex->corners[subset[i]].w;
    }
    if (!(v.squaredNorm() < least)) continue;
    least = v.squaredNorm();
    nearest = v;
    best.size = count;
    for (int i = 0; i < count; ++i) {
      best.corners[i] = simplex->corners[subset[i]];
      best.corners[i].weight = weights[i];
    }
  }
  *simplex = best;
  return nearest;
}

}  // namespace

Apart FindApart(const Query& query) {
  Apart result;
  Simplex simplex;
  Vector3d v = query.X_AB.p;
  if (!(v.squaredNorm() > 0)) v = Vector3d::UnitZ();
  double room = -math::kInfinity;
  double length = math::kInfinity;
  for (int step = 0; step < kMostSteps; ++step) {
    // n from A to B: B is extreme against it.
    const Vector3d n = v.normalized();
    Corner corner;
    corner.p_A = query.a.SupportPoint(n);
    corner.p_B = query.X_AB * query.b.SupportPoint(-(query.X_AB.R.transpose() * n));
    corner.w = corner.p_B - corner.p_A;
    room = std::max(room, n.dot(corner.w));
    if (length < math::kInfinity && length - n.dot(corner.w) <= 1e-15 + 1e-14 * length) break;
    const bool known = std::any_of(simplex.corners.begin(), simplex.corners.begin() + simplex.size,
                                   [&](const Corner& c) { return c.w == corner.w; });
    if (known) break;
    Simplex grown = simplex;
    grown.corners[grown.size++] = corner;
    const Vector3d next = Reduce(&grown);
    const double next_length = next.norm();
    if (!(next_length < length)) break;
    simplex = grown;
    v = next;
    length = next_length;
    if (length < kTouching || simplex.size == 4) return result;
  }
  if (!(room > 0)) return result;
  result.apart = true;
  for (int i = 0; i < simplex.size; ++i) {
    result.p_A += simplex.corners[i].weight * simplex.corners[i].p_A;
    result.p_B += simplex.corners[i].weight * simplex.corners[i].p_B;
  }
  return result;
}

bool SurelyOverlap(const Query& query) {
  constexpr int kFewSteps = 16;
  Simplex simplex;
  Vector3d v = query.X_AB.p;
  if (!(v.squaredNorm() > 0)) v = Vector3d::UnitZ();
  for (int step = 0; step < kFewSteps; ++step) {
    Corner corner;
    corner.p_A = query.a.SupportPoint(v);
    corner.p_B = query.X_AB * query.b.SupportPoint(-(query.X_AB.R.transpose() * v));
    corner.w = corner.p_B - corner.p_A;
    if (v.dot(corner.w) > 0) return false;
    simplex.corners[simplex.size++] = corner;
    v = Reduce(&simplex);
    if (simplex.size == 4) return true;
    if (!(v.norm() > kTouching)) return false;
  }
  return false;
}

}  // namespace tether::geometry::internal
