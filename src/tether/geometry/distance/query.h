#pragma once

#include <optional>

#include "tether/geometry/shape.h"

namespace tether::geometry {

/// The signed distance from a solid to a point.
///
/// Negative inside. `n_W` is the solid's outward normal at its nearest surface point, which is the gradient
/// of the distance in the point; q = nearest + distance · n always. Inside, where several faces are equally
/// near, the normal that points furthest up in the world wins. A compound's distance is the least over its
/// parts.
struct PointDistance {
  double distance = 0;                             ///< m
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();   ///< The nearest point of the surface.
  Eigen::Vector3d n_W = Eigen::Vector3d::UnitZ();  ///< Outward, unit.
  int part = 0;                                    ///< Index of the part; 0 for a primitive.
};

/// The distance from a solid at X_WS to the point Q of the world.
PointDistance DistanceToPoint(const Primitive& solid, const math::Pose& X_WS, const Eigen::Vector3d& p_WQ);
PointDistance DistanceToPoint(const Shape& solid, const math::Pose& X_WS, const Eigen::Vector3d& p_WQ);

/// The derivative of the distance in the point (in the world) and in a right perturbation of the solid's
/// pose.
struct PointDistanceDerivative {
  Eigen::Matrix<double, 1, 3> dQ;
  Eigen::Matrix<double, 1, 6> dS;
};
PointDistanceDerivative DifferentiatePointDistance(const PointDistance& distance, const math::Pose& X_WS);

/// Where a ray meets a solid.
struct RayHit {
  double t = 0;  ///< p = origin + t · direction.
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d n_W = Eigen::Vector3d::UnitZ();  ///< The outward normal of the surface there.
  int part = 0;
  bool from_inside = false;  ///< The ray starts inside; the hit is where it leaves.
};

/// How a ray that starts inside the solid is treated. One that starts on the surface, to rounding, may count
/// as inside or as entering at t = 0.
enum class RayStart {
  kExit,    ///< Report where it leaves.
  kIgnore,  ///< Report nothing: for sensors, whose own housing must not hide the world.
};

/// The first point with 0 ≤ t ≤ t_max where the ray enters the solid, or, where it starts inside, leaves it.
/// The direction need not be a unit vector; a zero or non-finite one hits nothing. A ray that only grazes a
/// flat face from within its plane counts as a hit where it first reaches the solid.
///
/// For a compound that the ray enters from outside this is the first entry into any part. A ray that starts
/// inside leaves where it leaves the union: parts that overlap or touch are passed through together.
std::optional<RayHit> CastRay(const Primitive& solid, const math::Pose& X_WS, const Eigen::Vector3d& origin_W,
                              const Eigen::Vector3d& direction_W, RayStart start = RayStart::kExit,
                              double t_max = 1e300);
std::optional<RayHit> CastRay(const Shape& solid, const math::Pose& X_WS, const Eigen::Vector3d& origin_W,
                              const Eigen::Vector3d& direction_W, RayStart start = RayStart::kExit,
                              double t_max = 1e300);

}  // namespace tether::geometry
