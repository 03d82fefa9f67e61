#pragma once

#include <Eigen/Core>

#include "tether/geometry/distance/distance.h"

namespace tether::control {

/// A rigid body at one of its points: the velocity of the material point, m/s, and the body's angular
/// velocity, rad/s, both in the world.
struct PointMotion {
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  Eigen::Vector3d w = Eigen::Vector3d::Zero();
};

/// What the second time derivative of a signed distance has besides the accelerations of the two material
/// points at the witness points, n · (a_B − a_A), m/s²: the normal turns, and the witness points slide on
/// their surfaces. With ω_X × n = w_X, C_X the Hessian of X's support function at its normal (the radii of
/// curvature: 0 at a vertex, infinite along an edge and on a face), and v the tangential part of v_B − v_A,
///
///   (d + C_A + C_B) ṅ = v + C_A w_A + C_B w_B,  s_A = C_A (ṅ − w_A),  s_B = C_B (w_B − ṅ),
///   d̈ = n · (a_B − a_A) + ṅ · v − s_B · w_B + s_A · w_A.
///
/// Exact where the witness points are unique. Where both surfaces are flat in one direction (faces, edges,
/// sides that are parallel) the distance has a kink; the value is then that of A's witness point as a vertex
/// of A. `a` and `b` as in `distance`; motions are those at its witness points. Allocates nothing.
double SlidingAcceleration(const geometry::Distance& distance, const geometry::Primitive& a,
                           const math::Pose& X_WA, const PointMotion& motion_a, const geometry::Primitive& b,
                           const math::Pose& X_WB, const PointMotion& motion_b);

}  // namespace tether::control
