#include "tether/geometry/least_turn.h"

#include <cmath>
#include <optional>

#include <Eigen/Geometry>

#include "tether/math/so3.h"

namespace tether::geometry {

Eigen::Vector3d LeastTurn(const Shape& shape, const Eigen::Matrix3d& R_WA, const Eigen::Matrix3d& R_WB) {
  constexpr double kCoaxial = 1e-6;  // m, rad
  std::optional<Eigen::Vector3d> axis_S;
  bool is_round = !shape.parts.empty();
  const auto add = [&](const Eigen::Vector3d& axis) {
    if (axis_S && axis_S->cross(axis).norm() > kCoaxial) is_round = false;
    axis_S = axis;
  };
  for (const Part& part : shape.parts) {
    const bool has_axis =
        std::holds_alternative<Cylinder>(part.primitive) || std::holds_alternative<Capsule>(part.primitive);
    if (!has_axis && !std::holds_alternative<Sphere>(part.primitive)) is_round = false;
    if (has_axis) add(part.X_SP.R.col(2));
    if (part.X_SP.p.norm() > kCoaxial) add(part.X_SP.p.normalized());
  }
  if (!is_round) return math::LogSO3(R_WB * R_WA.transpose());
  if (!axis_S) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d from = R_WA * *axis_S, to = R_WB * *axis_S, across = from.cross(to);
  const double angle = std::atan2(across.norm(), from.dot(to));
  // Upside down, any axis across will do.
  const Eigen::Vector3d about =
      across.norm() > 1e-12 ? Eigen::Vector3d(across.normalized()) : Eigen::Vector3d(from.unitOrthogonal());
  return angle * about;
}

}  // namespace tether::geometry
