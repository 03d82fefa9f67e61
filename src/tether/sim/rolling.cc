#include "tether/sim/rolling.h"

#include <algorithm>
#include <limits>
#include <variant>

#include <mujoco/mujoco.h>
#include <Eigen/Core>

namespace tether::sim {
namespace {

using Eigen::Vector3d;

// Axes that differ by less are one: the sine of their angle, and the distance from it, m.
constexpr double kSameAxis = 1e-3, kOnAxis = 1e-4;
// The arm of rolling resistance, m: the least with which tins of 8 to 50 mm stay within 0.1 mm for 5 s on
// level ground (with 1e-4 m 0.7 mm, without 11 mm); on a slope of angle a they roll from tan a = arm / radius
// on.
constexpr double kRollingFriction = 3e-4;

}  // namespace

bool Rolls(const geometry::Shape& shape) {
  bool known = false;  // Whether `axis` is; until then all centres so far are one.
  Vector3d centre = Vector3d::Zero(), axis = Vector3d::UnitZ();
  for (size_t i = 0; i < shape.parts.size(); ++i) {
    const geometry::Part& part = shape.parts[i];
    const bool sphere = std::holds_alternative<geometry::Sphere>(part.primitive);
    if (!sphere && !std::holds_alternative<geometry::Capsule>(part.primitive) &&
        !std::holds_alternative<geometry::Cylinder>(part.primitive))
      return false;
    if (i == 0) centre = part.X_SP.p;
    const Vector3d off = part.X_SP.p - centre;
    if (!known && !sphere) {
      axis = part.X_SP.R.col(2);
      known = true;
    } else if (!known && off.norm() > kOnAxis) {
      axis = off.normalized();
      known = true;
    } else if (known && !sphere && axis.cross(part.X_SP.R.col(2)).norm() > kSameAxis) {
      return false;
    }
    if (known && axis.cross(off).norm() > kOnAxis) return false;
  }
  return !shape.parts.empty();
}

void SetRollingFriction(mjModel_* model, const std::vector<bool>& rolls) {
  int first = std::numeric_limits<int>::max();
  for (int geom = 0; geom < model->ngeom; ++geom) {
    if (rolls[geom]) first = std::min(first, model->geom_priority[geom]);
  }
  // Of a pair the geom of the higher priority decides: what goes before something that rolls is told as well.
  for (int geom = 0; geom < model->ngeom; ++geom) {
    if (!rolls[geom] && model->geom_priority[geom] <= first) continue;
    model->geom_condim[geom] = 6;
    model->geom_friction[3 * geom + 2] = kRollingFriction;
  }
}

}  // namespace tether::sim
