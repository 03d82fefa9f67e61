#include "tether/geometry/distance/bounds.h"

#include <algorithm>
#include <cmath>

#include "tether/common/overloaded.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/math/infinity.h"

namespace tether::geometry {

double BoundingRadius(const Primitive& primitive) {
  if (const auto* box = std::get_if<Box>(&primitive)) return 0.5 * box->size.norm();
  if (const auto* sphere = std::get_if<Sphere>(&primitive)) return sphere->radius;
  if (const auto* capsule = std::get_if<Capsule>(&primitive)) return 0.5 * capsule->length + capsule->radius;
  if (const auto* hull = std::get_if<Hull>(&primitive)) return hull->polytope->radius;
  const auto& cylinder = std::get<Cylinder>(primitive);
  return std::hypot(cylinder.radius, 0.5 * cylinder.length);
}

double BoundingRadius(const Shape& shape) {
  double radius = 0;
  for (const Part& part : shape.parts) {
    radius = std::max(radius, part.X_SP.p.norm() + BoundingRadius(part.primitive));
  }
  return radius;
}

Aabb BoundingBox(const Primitive& primitive, const math::Pose& X_WP) {
  if (const auto* hull = std::get_if<Hull>(&primitive)) {
    Aabb box;
    for (const Eigen::Vector3d& p : hull->polytope->vertices) {
      const Eigen::Vector3d p_W = X_WP * p;
      box.Include({p_W, p_W});
    }
    return box;
  }
  const Eigen::Vector3d reach = std::visit(
      Overloaded{
          [&](const Box& box) -> Eigen::Vector3d { return X_WP.R.cwiseAbs() * (0.5 * box.size); },
          [](const Sphere& sphere) -> Eigen::Vector3d { return Eigen::Vector3d::Constant(sphere.radius); },
          [&](const Capsule& capsule) -> Eigen::Vector3d {
            return (0.5 * capsule.length * X_WP.R.col(2).cwiseAbs()).array() + capsule.radius;
          },
          [&](const Cylinder& cylinder) -> Eigen::Vector3d {
            // A disc with normal n reaches r sqrt(1 − nᵢ²) along axis i.
            const Eigen::Array3d n = X_WP.R.col(2).array();
            return 0.5 * cylinder.length * n.abs() + cylinder.radius * (1 - n.square()).max(0).sqrt();
          },
          [](const Hull&) -> Eigen::Vector3d { return Eigen::Vector3d::Zero(); }},
      primitive);
  return {X_WP.p - reach, X_WP.p + reach};
}

Aabb BoundingBox(const Shape& shape, const math::Pose& X_WS) {
  Aabb box;
  for (const Part& part : shape.parts) box.Include(BoundingBox(part.primitive, X_WS * part.X_SP));
  return box;
}

double DistanceLowerBound(const Shape& a, const math::Pose& X_WA, const Shape& b, const math::Pose& X_WB) {
  const double balls = (X_WB.p - X_WA.p).norm() - BoundingRadius(a) - BoundingRadius(b);
  const double boxes = BoundingBox(a, X_WA).DistanceTo(BoundingBox(b, X_WB));
  const double bound = std::max(balls, boxes);
  return bound > 0 ? bound : -math::kInfinity;
}

}  // namespace tether::geometry
