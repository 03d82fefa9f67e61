#include "testing/geometry/slow_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

#include "tether/common/random.h"
#include "tether/geometry/hull/polytope.h"

namespace tether::geometry {
namespace {

using Eigen::Vector3d;

double Separation(const Primitive& a, const math::Pose& X_WA, const Primitive& b, const math::Pose& X_WB,
                  const Vector3d& n) {
  return n.dot(X_WB.p - X_WA.p) - SlowSupport(a, X_WA.R.transpose() * n) -
         SlowSupport(b, -(X_WB.R.transpose() * n));
}

/// The greatest value met by a golden-section search of [−window, window].
template <class F>
double GoldenMax(double window, const F& f) {
  const double ratio = 0.5 * (std::sqrt(5.0) - 1);
  double lower = -window;
  double upper = window;
  double s = upper - ratio * (upper - lower);
  double t = lower + ratio * (upper - lower);
  double f_s = f(s);
  double f_t = f(t);
  double best = std::max(f_s, f_t);
  while (upper - lower > 1e-6 * window) {
    if (f_s > f_t) {
      upper = t;
      t = s;
      f_t = f_s;
      s = upper - ratio * (upper - lower);
      f_s = f(s);
    } else {
      lower = s;
      s = t;
      f_s = f_t;
      t = lower + ratio * (upper - lower);
      f_t = f(t);
    }
    best = std::max({best, f_s, f_t});
  }
  return best;
}

std::vector<Vector3d> SphereSample(int count) {
  std::vector<Vector3d> directions;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count;
    const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const double across = std::sqrt(1 - z * z);
    directions.emplace_back(across * std::cos(angle), across * std::sin(angle), z);
  }
  return directions;
}

/// The nearest of all points of all triangles (Ericson, Real-Time Collision Detection, section 5.1.5, finds
/// one by regions; here each triangle's plane, edges and corners are all tried).
Vector3d ProjectOnHull(const Polytope& hull, const Vector3d& q) {
  bool inside = true;
  for (const Polytope::Face& face : hull.faces) inside = inside && face.normal.dot(q) <= face.offset;
  if (inside) return q;
  Vector3d nearest = hull.vertices[0];
  const auto offer = [&](const Vector3d& p) {
    if ((p - q).squaredNorm() < (nearest - q).squaredNorm()) nearest = p;
  };
  for (const Polytope::Face& face : hull.faces) {
    for (size_t i = 1; i + 1 < face.corners.size(); ++i) {
      const std::array<Vector3d, 3> t = {hull.vertices[face.corners[0]], hull.vertices[face.corners[i]],
                                         hull.vertices[face.corners[i + 1]]};
      const Vector3d n = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
      const Vector3d foot = q - n * n.dot(q - t[0]);
      bool within = true;
      for (int k = 0; k < 3; ++k) {
        const Vector3d d = t[(k + 1) % 3] - t[k];
        within = within && n.dot(d.cross(foot - t[k])) >= 0;
        offer(t[k] + std::clamp((q - t[k]).dot(d) / d.squaredNorm(), 0.0, 1.0) * d);
      }
      if (within) offer(foot);
    }
  }
  return nearest;
}

/// Directions in which a solid alone may have a sharp peak of separation, of either sign.
std::vector<Vector3d> FaceNormals(const Primitive& primitive) {
  if (const auto* hull = std::get_if<Hull>(&primitive)) {
    std::vector<Vector3d> normals;
    for (const Polytope::Face& face : hull->polytope->faces) normals.push_back(face.normal);
    return normals;
  }
  return {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
}

}  // namespace

double SlowSupport(const Primitive& primitive, const Vector3d& d) {
  if (const auto* box = std::get_if<Box>(&primitive)) return 0.5 * d.cwiseAbs().dot(box->size);
  if (const auto* sphere = std::get_if<Sphere>(&primitive)) return sphere->radius * d.norm();
  if (const auto* capsule = std::get_if<Capsule>(&primitive)) {
    return 0.5 * capsule->length * std::abs(d.z()) + capsule->radius * d.norm();
  }
  if (const auto* hull = std::get_if<Hull>(&primitive)) {
    double greatest = -1e300;
    for (const Vector3d& p : hull->polytope->vertices) greatest = std::max(greatest, p.dot(d));
    return greatest;
  }
  const auto& cylinder = std::get<Cylinder>(primitive);
  return 0.5 * cylinder.length * std::abs(d.z()) + cylinder.radius * d.head<2>().norm();
}

Vector3d SlowProject(const Primitive& primitive, const Vector3d& q) {
  if (const auto* box = std::get_if<Box>(&primitive)) {
    return q.cwiseMin(0.5 * box->size).cwiseMax(-0.5 * box->size);
  }
  if (const auto* sphere = std::get_if<Sphere>(&primitive)) {
    return q.norm() > sphere->radius ? Vector3d(q.normalized() * sphere->radius) : q;
  }
  if (const auto* capsule = std::get_if<Capsule>(&primitive)) {
    const Vector3d centre(0, 0, std::clamp(q.z(), -0.5 * capsule->length, 0.5 * capsule->length));
    const Vector3d off = q - centre;
    return off.norm() > capsule->radius ? Vector3d(centre + off.normalized() * capsule->radius) : q;
  }
  if (const auto* hull = std::get_if<Hull>(&primitive)) return ProjectOnHull(*hull->polytope, q);
  const auto& cylinder = std::get<Cylinder>(primitive);
  Vector3d p = q;
  const double across = q.head<2>().norm();
  if (across > cylinder.radius) p.head<2>() *= cylinder.radius / across;
  p.z() = std::clamp(q.z(), -0.5 * cylinder.length, 0.5 * cylinder.length);
  return p;
}

double SlowSurfaceMiss(const Primitive& primitive, const Vector3d& q) {
  const double outside = (q - SlowProject(primitive, q)).norm();
  if (outside > 0) return outside;
  if (const auto* box = std::get_if<Box>(&primitive)) return (0.5 * box->size - q.cwiseAbs()).minCoeff();
  if (const auto* sphere = std::get_if<Sphere>(&primitive)) return sphere->radius - q.norm();
  if (const auto* capsule = std::get_if<Capsule>(&primitive)) {
    const double z = std::clamp(q.z(), -0.5 * capsule->length, 0.5 * capsule->length);
    return capsule->radius - (q - Vector3d(0, 0, z)).norm();
  }
  if (const auto* hull = std::get_if<Hull>(&primitive)) {
    double depth = 1e300;
    for (const Polytope::Face& face : hull->polytope->faces) {
      depth = std::min(depth, face.offset - face.normal.dot(q));
    }
    return depth;
  }
  const auto& cylinder = std::get<Cylinder>(primitive);
  return std::min(cylinder.radius - q.head<2>().norm(), 0.5 * cylinder.length - std::abs(q.z()));
}

namespace {

struct Bounds {
  double lower = -1e300, upper = 1e300;  // m
};

/// Accelerated projected gradient on the squared distance between both bodies. y is a point of B; the squared
/// distance of y to A is convex in y, its gradient y − (projection on A).
Bounds BoundDistance(const Primitive& a, const math::Pose& X_WA, const Primitive& b, const math::Pose& X_WB) {
  Vector3d y = X_WB.p;
  Vector3d ahead = y;
  double momentum = 1;
  Bounds bounds;
  for (int i = 0; i < 4000; ++i) {
    const Vector3d x = X_WA * SlowProject(a, X_WA.Inverse() * ahead);
    const Vector3d next = X_WB * SlowProject(b, X_WB.Inverse() * x);
    const Vector3d between = next - X_WA * SlowProject(a, X_WA.Inverse() * next);
    bounds.upper = std::min(bounds.upper, between.norm());
    if (between.norm() < 1e-9) break;
    bounds.lower = std::max(bounds.lower, Separation(a, X_WA, b, X_WB, between.normalized()));
    if (bounds.upper - bounds.lower < 1e-10) break;
    const bool overshot = (ahead - next).dot(next - y) > 0;
    const double momentum_next = overshot ? 1.0 : 0.5 * (1 + std::sqrt(1 + 4 * momentum * momentum));
    ahead = overshot ? next : Vector3d(next + (momentum - 1) / momentum_next * (next - y));
    momentum = momentum_next;
    y = next;
  }
  return bounds;
}

/// A unit normal, and the separation along it, m.
using Start = std::pair<double, Vector3d>;
bool IsGreater(const Start& s, const Start& t) { return s.first > t.first; }

/// The best normals of a dense sample, and likely peaks that are too narrow for it.
std::vector<Start> FindStarts(const Primitive& a, const math::Pose& X_WA, const Primitive& b,
                              const math::Pose& X_WB) {
  static const std::vector<Vector3d> kSample = SphereSample(3000);
  std::vector<Start> starts;
  for (const Vector3d& n : kSample) starts.emplace_back(Separation(a, X_WA, b, X_WB, n), n);
  constexpr int kKept = 24;
  std::partial_sort(starts.begin(), starts.begin() + kKept, starts.end(), IsGreater);
  starts.resize(kKept);
  // Thin solids have peaks too narrow for the sample, at normals of faces and across pairs of axes.
  const auto start_at = [&](const Vector3d& n) {
    for (const double sign : {1.0, -1.0}) {
      starts.emplace_back(Separation(a, X_WA, b, X_WB, sign * n), sign * n);
    }
  };
  for (const Vector3d& n : FaceNormals(a)) start_at(X_WA.R * n);
  for (const Vector3d& n : FaceNormals(b)) start_at(X_WB.R * n);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Vector3d n = X_WA.R.col(i).cross(X_WB.R.col(j)).normalized();
      if (n.norm() > 0.5) start_at(n);
    }
  }
  return starts;
}

/// Climbs from each start by random local search.
void ClimbAtRandom(const Primitive& a, const math::Pose& X_WA, const Primitive& b, const math::Pose& X_WB,
                   std::vector<Start>& starts) {
  Random random(1);
  for (auto& [value, n] : starts) {
    for (double step = 0.1; step > 1e-9;) {
      bool gained = false;
      for (int poll = 0; poll < 6 && !gained; ++poll) {
        const Vector3d trial =
            (n + step * Vector3d(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1)))
                .normalized();
        const double there = Separation(a, X_WA, b, X_WB, trial);
        if (there > value) {
          value = there;
          n = trial;
          gained = true;
        }
      }
      if (!gained) step *= 0.6;
    }
  }
}

/// Climbs on from one start by a golden-section search within another: random steps stall on the ridges of
/// the separation.
double ClimbAlongRidges(const Primitive& a, const math::Pose& X_WA, const Primitive& b,
                        const math::Pose& X_WB, Start start) {
  auto& [value, n] = start;
  for (int round = 0; round < 20; ++round) {
    const double before = value;
    for (const double window : {0.1, 0.001}) {
      const Vector3d u = n.unitOrthogonal();
      const Vector3d v = n.cross(u);
      Vector3d top = n;
      GoldenMax(window, [&](double along_u) {
        return GoldenMax(window, [&](double along_v) {
          const Vector3d trial = (n + along_u * u + along_v * v).normalized();
          const double there = Separation(a, X_WA, b, X_WB, trial);
          if (there > value) {
            value = there;
            top = trial;
          }
          return there;
        });
      });
      n = top;
    }
    if (value - before < 1e-9) break;
  }
  return value;
}

}  // namespace

SlowResult SlowDistance(const Primitive& a, const math::Pose& X_WA, const Primitive& b,
                        const math::Pose& X_WB) {
  const Bounds bounds = BoundDistance(a, X_WA, b, X_WB);
  if (bounds.lower > 1e-7 || bounds.upper - bounds.lower < 1e-10) {
    return {bounds.upper, bounds.upper - bounds.lower};
  }
  std::vector<Start> starts = FindStarts(a, X_WA, b, X_WB);
  ClimbAtRandom(a, X_WA, b, X_WB, starts);
  std::sort(starts.begin(), starts.end(), IsGreater);
  double best = -1e300;
  for (size_t i = 0; i < 3; ++i) best = std::max(best, ClimbAlongRidges(a, X_WA, b, X_WB, starts[i]));
  return {best, 0};
}

}  // namespace tether::geometry
