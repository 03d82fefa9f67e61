#pragma once

#include <vector>

#include "tether/geometry/shape.h"

namespace tether::geometry {

/// The signed distance between two solids, with its witness points.
///
/// `distance` is positive when they are apart; when they overlap it is minus the penetration depth, the
/// length of the shortest translation that separates them. `n_W` is the unit normal from A to B: the gradient
/// of the distance in a translation of B. It comes from the surfaces that face each other, never from p_WB −
/// p_WA, so it is well defined at contact and does not flip in penetration (ERRATA A3, A10). Always p_WB −
/// p_WA = distance · n_W.
///
/// Ties. Where the nearest points are not unique (faces or edges parallel to within 1e-8 rad), the witness
/// points are the centre of the region in which the two faces overlap (a round face counts as its inscribed
/// 16-gon). Where several normals give the same depth (solids with coincident centres), a face's normal goes
/// before that of two crossing edges, then the normal that points furthest up in the world wins (ERRATA
/// A12d). The distance is continuous everywhere, its derivative is one-sided at a tie.
struct Distance {
  double distance = 0;                             ///< m
  Eigen::Vector3d p_WA = Eigen::Vector3d::Zero();  ///< The witness point on A.
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();  ///< The witness point on B.
  Eigen::Vector3d n_W = Eigen::Vector3d::UnitZ();  ///< From A to B.
  int part_a = 0;                                  ///< Index of the part of A; 0 for a primitive.
  int part_b = 0;
};

/// The signed distance of two primitives. Allocates nothing; total for finite poses and sizes ≥ 0.
/// Exact (about 1e-12 m) among boxes, spheres and capsules, and for a sphere and a cylinder; 1e-9 m or so
/// where a cylinder meets a capsule, a box or a cylinder.
Distance SignedDistance(const Primitive& a, const math::Pose& X_WA, const Primitive& b,
                        const math::Pose& X_WB);

/// The signed distance of two shapes: the least over pairs of parts. For overlapping compounds this is the
/// least over parts too, which may be less than the depth of the union. Both shapes must have a part.
Distance SignedDistance(const Shape& a, const math::Pose& X_WA, const Shape& b, const math::Pose& X_WB);

/// One distance per pair of parts whose distance is below `cutoff`, ordered by (part_a, part_b). ERRATA A8:
/// every near pair gets its own row, since the least of them is not smooth.
std::vector<Distance> PartDistances(const Shape& a, const math::Pose& X_WA, const Shape& b,
                                    const math::Pose& X_WB, double cutoff);

/// The derivative of a signed distance in right perturbations δ = (translation, rotation) of both poses.
struct DistanceDerivative {
  Eigen::Matrix<double, 1, 6> dA;
  Eigen::Matrix<double, 1, 6> dB;
};

/// Exact where the witness points or at least the normal are unique (ERRATA A4): the normal gives the part of
/// the translation, its moment about each frame's origin the part of the rotation.
DistanceDerivative DifferentiateDistance(const Distance& distance, const math::Pose& X_WA,
                                         const math::Pose& X_WB);

}  // namespace tether::geometry
