#pragma once

#include "tether/geometry/polygon/support.h"
#include "tether/math/pose.h"

namespace tether::constraints {

/// For a face that is the convex hull of several parts' faces in one plane: the share of it that the parts
/// fill, in [0, 1] (the exact area of their union over that of the hull). 1 if the hull has no area.
double FilledShare(const geometry::Shape& shape, const geometry::FlatFacet& face);

/// The convex hull of where the footprint of A (the hull of its lower face), standing on its face in the
/// direction `down_A`, touches the faces of B's parts on the plane of `level` (in B's frame), in that plane's
/// axes. A solid that stands there is carried if its centre of mass is over it. Empty if A touches none of
/// them.
geometry::Polygon ContactHull(const geometry::Shape& a, const Eigen::Vector3d& down_A, const math::Pose& X_BA,
                              const geometry::Shape& b, const geometry::FlatFacet& level);

}  // namespace tether::constraints
