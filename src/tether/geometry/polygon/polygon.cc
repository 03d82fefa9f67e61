#include "tether/geometry/polygon/polygon.h"

#include <algorithm>
#include <cmath>

#include "tether/math/infinity.h"

namespace tether::geometry {
namespace {

using Eigen::Vector2d;

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double DistanceToSegment(const Vector2d& a, const Vector2d& b, const Vector2d& q) {
  const Vector2d d = b - a;
  const double length2 = d.squaredNorm();
  const double t = length2 > 0 ? std::clamp((q - a).dot(d) / length2, 0.0, 1.0) : 0.0;
  return (q - a - t * d).norm();
}

}  // namespace

Polygon ConvexHull(std::vector<Vector2d> points, double tolerance) {
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  Polygon unique;
  for (const Vector2d& p : points) {
    const bool repeated = std::any_of(unique.begin(), unique.end(),
                                      [&](const Vector2d& q) { return (p - q).norm() <= tolerance; });
    if (!repeated) unique.push_back(p);
  }
  if (unique.size() < 3) return unique;
  Polygon hull;
  const auto sweep = [&](auto first, auto last) {
    const size_t base = hull.size();
    for (auto it = first; it != last; ++it) {
      while (hull.size() >= base + 2) {
        const Vector2d& a = hull[hull.size() - 2];
        const Vector2d& b = hull.back();
        // b stays only if it stands out of the line from a to the new point.
        if (Cross(*it - a, b - a) < -tolerance * (*it - a).norm()) break;
        hull.pop_back();
      }
      hull.push_back(*it);
    }
    hull.pop_back();
  };
  sweep(unique.begin(), unique.end());
  sweep(unique.rbegin(), unique.rend());
  return hull;
}

double Area(const Polygon& polygon) {
  double twice = 0;
  for (size_t i = 1; i + 1 < polygon.size(); ++i) {
    twice += Cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
  }
  return 0.5 * twice;
}

Vector2d Centroid(const Polygon& polygon) {
  if (polygon.empty()) return Vector2d::Zero();
  double twice = 0;
  Vector2d moment = Vector2d::Zero();
  Vector2d sum = Vector2d::Zero();
  double longest2 = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    sum += polygon[i];
    longest2 = std::max(longest2, (polygon[i] - polygon[0]).squaredNorm());
    if (i == 0 || i + 1 >= polygon.size()) continue;
    const Vector2d u = polygon[i] - polygon[0];
    const Vector2d v = polygon[i + 1] - polygon[0];
    twice += Cross(u, v);
    moment += Cross(u, v) * (u + v) / 3;
  }
  if (twice > 1e-12 * longest2 && twice > 0) return polygon[0] + moment / twice;
  return sum / static_cast<double>(polygon.size());
}

std::vector<HalfPlane> EdgeHalfPlanes(const Polygon& polygon) {
  std::vector<HalfPlane> half_planes;
  if (polygon.size() < 3) return half_planes;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d d = (polygon[(i + 1) % polygon.size()] - polygon[i]).normalized();
    const Vector2d normal(d.y(), -d.x());
    half_planes.push_back({normal, normal.dot(polygon[i])});
  }
  return half_planes;
}

double ContainmentMargin(const Polygon& polygon, const Vector2d& point) {
  if (polygon.empty()) return -math::kInfinity;
  double nearest = math::kInfinity;
  bool inside = polygon.size() >= 3;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& a = polygon[i];
    const Vector2d& b = polygon[(i + 1) % polygon.size()];
    nearest = std::min(nearest, DistanceToSegment(a, b, point));
    if (Cross(b - a, point - a) < 0) inside = false;
  }
  return inside ? nearest : -nearest;
}

void CutInto(const Polygon& polygon, const HalfPlane& half_plane, Polygon* cut) {
  cut->clear();
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& p = polygon[i];
    const Vector2d& q = polygon[(i + 1) % polygon.size()];
    const double past_p = half_plane.normal.dot(p) - half_plane.offset;
    const double past_q = half_plane.normal.dot(q) - half_plane.offset;
    if (past_p <= 0) cut->push_back(p);
    const bool crosses = (past_p < 0 && past_q > 0) || (past_p > 0 && past_q < 0);
    if (crosses && (polygon.size() != 2 || i == 0))
      cut->push_back(p + (q - p) * (past_p / (past_p - past_q)));
  }
}

Polygon Cut(const Polygon& polygon, const HalfPlane& half_plane) {
  Polygon cut;
  CutInto(polygon, half_plane, &cut);
  return cut;
}

Polygon Shrink(const Polygon& polygon, double margin) {
  if (margin <= 0) return polygon;
  if (polygon.size() < 3) return {};
  Polygon result = polygon;
  for (HalfPlane half_plane : EdgeHalfPlanes(polygon)) {
    half_plane.offset -= margin;
    result = Cut(result, half_plane);
  }
  return ConvexHull(result, 1e-12);
}

Polygon Transform(const Polygon& polygon, double yaw, const Vector2d& translation) {
  const double c = std::cos(yaw);
  const double s = std::sin(yaw);
  Polygon result;
  for (const Vector2d& p : polygon) {
    result.push_back(Vector2d(c * p.x() - s * p.y(), s * p.x() + c * p.y()) + translation);
  }
  return result;
}

}  // namespace tether::geometry
