#include "tether/motion/kernel/sphere_cover.h"

#include <algorithm>
#include <cmath>
#include <variant>

#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/distance/query.h"

namespace tether::motion::internal {
namespace {

using Eigen::Vector3d;

// Balls along a capsule are at most this far apart, as a share of its radius: they stick out by 4 %.
constexpr double kSpacing = 0.6;
constexpr int kMostAlong = 40;
// About so many cells for other kinds.
constexpr double kCells = 12;

std::vector<CoverSphere> CoverCapsule(double radius, double length) {
  const double pieces = std::ceil(length / (kSpacing * radius));
  const int n = length > 0 ? static_cast<int>(std::clamp(pieces, 1.0, double{kMostAlong})) : 0;
  const double outer = n == 0 ? radius : std::hypot(radius, length / (2 * n));
  std::vector<CoverSphere> cover;
  for (int i = 0; i <= n; ++i)
    cover.push_back(
        {Vector3d(0, 0, n == 0 ? 0 : length * (static_cast<double>(i) / n - 0.5)), outer, radius});
  return cover;
}

/// Balls about the cells of a grid that the solid meets.
std::vector<CoverSphere> CoverCells(const geometry::Primitive& primitive) {
  const geometry::Aabb box = geometry::BoundingBox(primitive, math::Pose());
  const Vector3d size = (box.upper - box.lower).cwiseMax(1e-6);
  const double edge = std::cbrt(size.prod() / kCells);
  Eigen::Vector3i count;
  for (int i = 0; i < 3; ++i) count[i] = static_cast<int>(std::clamp(std::round(size[i] / edge), 1.0, 12.0));
  const Vector3d cell = size.cwiseQuotient(count.cast<double>());
  const double outer = 0.5 * cell.norm();
  std::vector<CoverSphere> cover;
  for (int x = 0; x < count[0]; ++x) {
    for (int y = 0; y < count[1]; ++y) {
      for (int z = 0; z < count[2]; ++z) {
        const Vector3d p = box.lower + cell.cwiseProduct(Vector3d(x + 0.5, y + 0.5, z + 0.5));
        const double distance = geometry::DistanceToPoint(primitive, math::Pose(), p).distance;
        if (distance < outer * 1.0001) cover.push_back({p, outer, std::max(0.0, -distance)});
      }
    }
  }
  return cover;
}

}  // namespace

std::vector<CoverSphere> CoverWithSpheres(const geometry::Primitive& primitive) {
  if (const auto* sphere = std::get_if<geometry::Sphere>(&primitive))
    return {{Vector3d::Zero(), sphere->radius, sphere->radius}};
  if (const auto* capsule = std::get_if<geometry::Capsule>(&primitive)) {
    if (capsule->radius > 0) return CoverCapsule(capsule->radius, capsule->length);
  }
  return CoverCells(primitive);
}

}  // namespace tether::motion::internal
