#pragma once

#include <cstdint>

#include "tether/geometry/shape.h"

namespace tether::geometry {

/// The result of SlowDistance(), an oracle for SignedDistance() that shares no code with it. About 1 ms per
/// pair.
struct SlowResult {
  double distance = 0;  ///< m, signed as in Distance.
  /// When apart: how far the nearest points found are from a lower bound of the distance, a certificate, m.
  /// Of an overlap it is 0: a depth is searched by sampling directions, and found exactly but without proof.
  double uncertainty = 0;
};

/// Apart: accelerated projected gradient on |x − y|² over both bodies. Overlapping: the greatest separation
/// over unit normals, from a dense sample of the sphere, refined by random local search with a fixed seed.
SlowResult SlowDistance(const Primitive& a, const math::Pose& X_WA, const Primitive& b,
                        const math::Pose& X_WB);

/// The support function: max over the solid of d · x, in the solid's frame; written out per primitive.
double SlowSupport(const Primitive& primitive, const Eigen::Vector3d& d);

/// The nearest point of the solid to q (q itself when inside), in the solid's frame.
Eigen::Vector3d SlowProject(const Primitive& primitive, const Eigen::Vector3d& q);

/// How far a point in the solid's frame is from its surface, inside or outside, m.
double SlowSurfaceMiss(const Primitive& primitive, const Eigen::Vector3d& q);

}  // namespace tether::geometry
