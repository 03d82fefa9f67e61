#include "tether/execution/top_grasp.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "tether/constraints/grasp.h"
#include "tether/geometry/support.h"

namespace tether::execution {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Widths that differ by less are as good; the hand then turns the shorter way.
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
                                     const math::Pose& X_WO, const Matrix3d& R_WH_now, std::string* reason,
                                     double palm_clearance, double foot_clearance) {
  const robot::Gripper& gripper = model.gripper();
  const Vector3d down_O = -X_WO.R.transpose().col(2);
  const double foot = geometry::Support(shape, down_O);
  std::optional<TopGrasp> best;
  double narrowest = std::numeric_limits<double>::infinity(), best_turn = 0;
  for (const geometry::Part& part : shape.parts) {
    const Vector3d down_P = part.X_SP.R.transpose() * down_O;
    // Along the part's own axis where it stands almost upright: bodies lean by rounding.
    Vector3d approach_P = down_P;
    for (int i = 0; i < 3; ++i) {
      if (std::abs(down_P[i]) > 0.95) approach_P = Vector3d::Unit(i) * (down_P[i] > 0 ? 1 : -1);
    }
    for (const constraints::ClosingDirection& way :
         constraints::ClosingDirections(part.primitive, approach_P)) {
      narrowest = std::min(narrowest, way.width);
      if (way.width > gripper.max_width || way.width > gripper.max_opening - 0.005) continue;
      Vector3d closing =
          way.axis_P ? Vector3d(X_WO.R * (part.X_SP.R * *way.axis_P)) : Vector3d(R_WH_now.col(1));
      closing.z() = 0;
      if (closing.norm() < 1e-3) closing = Vector3d::UnitY();
      closing.normalize();
      for (const double side : {1.0, -1.0}) {
        const Matrix3d R_WH = HandRotation(side * closing);
        const double turn = math::AngleBetween(R_WH, R_WH_now);
        const bool narrower = !best || way.width < best->width - kSameWidth;
        if (!narrower && (way.width > best->width + kSameWidth || turn >= best_turn)) continue;
        const geometry::Shape alone(std::vector<geometry::Part>{part});
        const double top = geometry::Support(alone, -down_O);
        const double tips = geometry::Support(model.HandShape(way.width), Vector3d::UnitZ());
        const double above_origin =
            std::max(top - (gripper.palm_depth - palm_clearance), -foot + tips + foot_clearance);
        // Above the part's centre, at this height.
        Vector3d p_O = part.X_SP.p;
        p_O += down_O * (-above_origin - down_O.dot(p_O));
        best = TopGrasp{math::Between(X_WO, math::Pose(R_WH, X_WO * p_O)), way.width};
        best_turn = turn;
      }
    }
  }
  if (!best && reason != nullptr) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "it is %.1f cm wide where it is narrowest, and the gripper takes %.1f cm", 100 * narrowest,
                  100 * std::min(gripper.max_width, gripper.max_opening - 0.005));
    *reason = std::isfinite(narrowest) ? text : "it has no pair of faces that fingers could close on";
  }
  return best;
}

}  // namespace tether::execution
