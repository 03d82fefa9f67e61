#pragma once

#include <vector>

#include <Eigen/Core>

#include "tether/geometry/distance/bounds.h"
#include "tether/math/pose.h"

namespace tether::execution {

/// Distances that a transit keeps from what it passes, m.
struct TransitMargins {
  double side = 0.025;   ///< Objects nearer than this beside the motion are obstructions.
  double above = 0.025;  ///< The motion passes this much above them.
};

/// Whether a straight motion is free, and the height at which it would be.
struct Passage {
  bool blocked = false;
  double height = 0;  ///< z of the body's origin at which all obstructions are cleared, m; if blocked.
};

/// Checks the straight motion of a body's origin from `p_from` to `p_to` (world, z up) against obstacles.
/// `body`: boxes of its parts relative to its origin. Obstacles that the body passes beneath are no
/// obstructions, nor are those that could be cleared only above `ceiling` (m).
Passage CheckPassage(const std::vector<geometry::Aabb>& body, const Eigen::Vector3d& p_from,
                     const Eigen::Vector3d& p_to, const std::vector<geometry::Aabb>& obstacles,
                     const TransitMargins& margins, double ceiling);

/// The pose that a transit should head for now. A plan holds no path between key poses, so obstructions are
/// passed above: straight up to the safe height, across, and straight down onto the goal.
math::Pose TransitWaypoint(const Passage& passage, const math::Pose& X_WR, const math::Pose& X_WG);

/// The same pose, displaced so that a point of the hand, given in its frame, is no further than `radius` (m)
/// from `p_WCentre`: a hand that rises at the edge of the arm's reach must come nearer meanwhile.
math::Pose DrawWithin(const math::Pose& X_WH, const Eigen::Vector3d& p_HQ, const Eigen::Vector3d& p_WCentre,
                      double radius);

/// The pose that the approach to a goal should head for now. The approach leads along the unit direction
/// `direction`, from `length` m before the goal. The further the hand is beside that line (m, and 0.1 m per
/// rad), the further back it must be: a hand that is too low steps back first, then aligns, then advances,
/// instead of sweeping away what it reaches for. All in one frame: the goal G, the reference R and the
/// measured hand H.
math::Pose FunnelWaypoint(const math::Pose& X_TG, const Eigen::Vector3d& direction, double length,
                          const math::Pose& X_TR, const math::Pose& X_TH);

}  // namespace tether::execution
