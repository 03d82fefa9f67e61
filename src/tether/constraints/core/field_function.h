#pragma once

#include <vector>

#include "tether/constraints/core/pose_function.h"

namespace tether::constraints {

/// Functions used mostly by velocity control: with those of pose_function.h they are the primitives of
/// vector-field inequalities (Marinho et al. 2019). Each is a function of frames (B, A), mostly with B fixed
/// and A on the arm, that must not be above zero.
///
/// | primitive | function |
/// | --- | --- |
/// | point–point, point–line, point–plane | MakePointDistance, MakeAxisDistance, MakeHalfSpaces |
/// | line–line, line–plane, line–cone | MakeLineDistance, MakeDirections, MakeAngle |
/// | point–cone, its rectangular form | MakePointCone, MakeFrustum |
/// | capped cylinder, any two solids | MakePartDistance: continuous, unlike rows that switch (ERRATA B3) |

/// A line through a point along a unit direction, in some frame.
struct Line {
  Eigen::Vector3d p;
  Eigen::Vector3d u;
};

/// Frames (B, A). sign · (distance of a line of A from a line of B − distance), m. Lines parallel to within
/// 1e-8 rad are as far apart as A's point is from B's line.
PoseFunctionPtr MakeLineDistance(const Line& line_B, const Line& line_A, double distance, double sign);

/// Frames (B, A). The angle between direction d_A of A and e_B of B, less `max`, rad: keeps a line within a
/// cone about e_B (Quiroz-Omaña and Adorno 2019). Smooth except at angles of 0 and π, where the derivative is
/// set to zero.
PoseFunctionPtr MakeAngle(const Eigen::Vector3d& d_A, const Eigen::Vector3d& e_B, double max);

/// Frames (B, A). The same with a cone that narrows towards B's xy plane: the angle less (max + per_height ·
/// z), rad, where z ≥ 0 is the height of the point Q of A in B. So an object is upright when it is put down.
PoseFunctionPtr MakeNarrowingAngle(const Eigen::Vector3d& d_A, const Eigen::Vector3d& e_B, double max,
                                   double per_height, const Eigen::Vector3d& p_AQ);

/// Frames (B, A). How far the point Q of A is outside the cone trunk that leads to the disc of `radius` in
/// B's xy plane, m: ‖(x, y)‖ − ρ with ρ = max(0, radius + (R₀ − radius) · z / h₀), where Q is at (x, y, z) in
/// B and started at a distance R₀ from B's z axis and a height h₀ ≠ 0. Paper B, eqs. (3)–(11), in the form of
/// ERRATA B1; a start within the radius gives the cylinder ρ = radius.
PoseFunctionPtr MakePointCone(double radius, const Eigen::Vector3d& p_BQ_start, const Eigen::Vector3d& p_AQ);

/// The same for a rectangle of full sides `size` in B's xy plane: four rows, each the signed distance of Q
/// from the plane through one side that the start lies on, or the vertical one where the start is within that
/// side. ERRATA B8.
PoseFunctionPtr MakeFrustum(const Eigen::Vector2d& size, const Eigen::Vector3d& p_BQ_start,
                            const Eigen::Vector3d& p_AQ);

}  // namespace tether::constraints
