#include "tether/constraints/grasps/top_grasp.h"

#include <algorithm>
#include <cmath>

#include "tether/geometry/polygon/support.h"

namespace tether::constraints {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Widths that differ by less are equal; the hand then turns through the smaller angle.
constexpr double kSameWidth = 1e-3;

Matrix3d HandRotation(const Vector3d& closing_W) {
  Matrix3d R_WH;
  R_WH.col(2) = -Vector3d::UnitZ();
  R_WH.col(1) = closing_W;
  R_WH.col(0) = R_WH.col(1).cross(R_WH.col(2));
  return R_WH;
}

}  // namespace

std::optional<TopGrasp> FindTopGrasp(const robot::Model& model, const geometry::Shape& shape,
                                     const math::Pose& X_WO, const Matrix3d& R_WH_now, const Load& load,
                                     GraspFlaws* flaws, double palm_clearance, double foot_clearance) {
  const robot::Gripper& gripper = model.gripper();
  const Fingers fingers = FingersOf(&model);
  const Vector3d down_O = -X_WO.R.transpose().col(2);
  const double foot = geometry::Support(shape, down_O);
  GraspFlaws unasked;
  std::optional<TopGrasp> best;
  double best_turn = 0;
  for (size_t i = 0; i < shape.parts.size(); ++i) {
    const geometry::Part& part = shape.parts[i];
    // Along the part's own axis where it stands almost upright: bodies lean by rounding.
    Vector3d approach_O = down_O;
    const bool hull = std::holds_alternative<geometry::Hull>(part.primitive);
    for (int axis = 0; axis < 3 && !hull; ++axis) {
      const Vector3d along = part.X_SP.R.col(axis);
      if (std::abs(along.dot(down_O)) > 0.95) approach_O = along.dot(down_O) > 0 ? along : Vector3d(-along);
    }
    for (const Grasp& grasp : GraspsOfPart(shape, static_cast<int>(i), approach_O, down_O, fingers, load,
                                           true, flaws != nullptr ? *flaws : unasked)) {
      // Closing along the grasp's direction, or along the hand's own; above the grasp's centre.
      Vector3d closing = grasp.closing_O ? Vector3d(X_WO.R * *grasp.closing_O) : Vector3d(R_WH_now.col(1));
      closing.z() = 0;
      if (closing.norm() < 1e-3) closing = Vector3d::UnitY();
      closing.normalize();
      for (const double side : {1.0, -1.0}) {
        const Matrix3d R_WH = HandRotation(side * closing);
        const double turn = math::AngleBetween(R_WH, R_WH_now);
        const bool narrower = !best || grasp.width < best->width - kSameWidth;
        if (!narrower && (grasp.width > best->width + kSameWidth || turn >= best_turn)) continue;
        const double top = PartSupport(part, -down_O);
        const double tips = geometry::Support(model.HandShape(grasp.width), Vector3d::UnitZ());
        const double above_origin =
            std::max(top - (gripper.palm_depth - palm_clearance), -foot + tips + foot_clearance);
        // At this height.
        const Vector3d p_O = grasp.centre_O + down_O * (-above_origin - down_O.dot(grasp.centre_O));
        best = TopGrasp{math::Between(X_WO, math::Pose(R_WH, X_WO * p_O)), grasp.width};
        best_turn = turn;
      }
    }
  }
  return best;
}

}  // namespace tether::constraints
