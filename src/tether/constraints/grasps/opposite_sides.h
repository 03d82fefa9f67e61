#pragma once

#include <string>
#include <vector>

#include "tether/constraints/grasps/surface.h"

namespace tether::constraints {

/// Two flat sides of a convex part that face away from each other, so that parallel fingers can hold the part
/// there. All in the frame of the shape that the part belongs to.
struct OppositeSides {
  Eigen::Vector3d
      closing;             ///< Unit, across the approach: midway between one normal and the other's opposite.
  double width;            ///< Of the part along `closing`, m.
  Eigen::Vector3d centre;  ///< Midway between the sides, in the middle of their overlap.
  std::vector<FaceEdge> bounds;  ///< normal · x ≤ offset where a line along `closing` meets both sides, or a
                                 ///< little further in.
  std::string name;  ///< "sides 3 and 5"
};

/// Sides this far from parallel to the fingers still count, rad.
inline constexpr double kNearlyParallel = 0.1;

/// The pairs for fingers that move along `approach`, each side in one pair at most, the most parallel first.
/// Sides that are narrower than a finger needs count only if the part is not much narrower in a direction
/// near by, into which the fingers would turn it. `finger` is the distance that the middle of a finger keeps
/// from the edges of the overlap of the two sides where there is room, m.
std::vector<OppositeSides> FindOppositeSides(const geometry::Part& part, const Eigen::Vector3d& approach,
                                             double finger);

}  // namespace tether::constraints
