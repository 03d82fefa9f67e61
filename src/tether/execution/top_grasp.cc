#include "tether/execution/top_grasp.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tether/common/text.h"
#include "tether/constraints/grasp.h"
#include "tether/constraints/opposite_sides.h"
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
  // Closing along `axis_O`, or along the hand's own closing axis; above `centre_O`.
  const auto consider = [&](const geometry::Part& part, double width, const std::optional<Vector3d>& axis_O,
                            const Vector3d& centre_O) {
    narrowest = std::min(narrowest, width);
    if (width > gripper.max_width || width > gripper.max_opening - 0.005) return;
    Vector3d closing = axis_O ? Vector3d(X_WO.R * *axis_O) : Vector3d(R_WH_now.col(1));
    closing.z() = 0;
    if (closing.norm() < 1e-3) closing = Vector3d::UnitY();
    closing.normalize();
    for (const double side : {1.0, -1.0}) {
      const Matrix3d R_WH = HandRotation(side * closing);
      const double turn = math::AngleBetween(R_WH, R_WH_now);
      const bool narrower = !best || width < best->width - kSameWidth;
      if (!narrower && (width > best->width + kSameWidth || turn >= best_turn)) continue;
      const geometry::Shape alone(std::vector<geometry::Part>{part});
      const double top = geometry::Support(alone, -down_O);
      const double tips = geometry::Support(model.HandShape(width), Vector3d::UnitZ());
      const double above_origin =
          std::max(top - (gripper.palm_depth - palm_clearance), -foot + tips + foot_clearance);
      // At this height.
      const Vector3d p_O = centre_O + down_O * (-above_origin - down_O.dot(centre_O));
      best = TopGrasp{math::Between(X_WO, math::Pose(R_WH, X_WO * p_O)), width};
      best_turn = turn;
    }
  };
  for (const geometry::Part& part : shape.parts) {
    if (std::holds_alternative<geometry::Hull>(part.primitive)) {
      for (const constraints::OppositeSides& sides :
           constraints::FindOppositeSides(part, down_O, gripper.pad_half_width)) {
        consider(part, sides.width, sides.closing, sides.centre);
      }
      continue;
    }
    const Vector3d down_P = part.X_SP.R.transpose() * down_O;
    // Along the part's own axis where it stands almost upright: bodies lean by rounding.
    Vector3d approach_P = down_P;
    for (int i = 0; i < 3; ++i) {
      if (std::abs(down_P[i]) > 0.95) approach_P = Vector3d::Unit(i) * (down_P[i] > 0 ? 1 : -1);
    }
    for (const constraints::ClosingDirection& way :
         constraints::ClosingDirections(part.primitive, approach_P)) {
      consider(part, way.width,
               way.axis_P ? std::optional<Vector3d>(part.X_SP.R * *way.axis_P) : std::nullopt, part.X_SP.p);
    }
  }
  if (!best && reason != nullptr) {
    char text[160];
    FormatInto(text, sizeof text, "it is %.1f cm wide where it is narrowest, and the gripper takes %.1f cm",
               100 * narrowest, 100 * std::min(gripper.max_width, gripper.max_opening - 0.005));
    *reason = std::isfinite(narrowest) ? text : "it has no pair of faces that fingers could close on";
  }
  return best;
}

}  // namespace tether::execution
