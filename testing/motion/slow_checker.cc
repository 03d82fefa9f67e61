#include "testing/motion/slow_checker.h"

#include <algorithm>

#include "tether/geometry/distance/distance.h"
#include "tether/robot/kinematics.h"

namespace tether::motion {

double SlowDistance(const Snapshot& snapshot, const Eigen::VectorXd& q) {
  const robot::ArmSolids& solids = snapshot.model->solids();
  robot::Kinematics kinematics(snapshot.model);
  kinematics.Set(q);
  const geometry::Shape hand = snapshot.model->HandShape(snapshot.opening);
  double least = 1e300;
  const auto shape = [&](int solid) -> const geometry::Shape& {
    return solid == solids.hand() ? hand : solids.links[solid].shape;
  };
  const auto add = [&](const geometry::Shape& a, const math::Pose& X_BA, const geometry::Shape& b,
                       const math::Pose& X_BB) {
    least = std::min(least, geometry::SignedDistance(a, X_BA, b, X_BB).distance);
  };
  for (const Obstacle& obstacle : snapshot.obstacles) {
    for (int solid = 0; solid <= solids.hand(); ++solid) {
      if (kinematics.LinkOf(solid) > 0)
        add(shape(solid), kinematics.X_BSolid(solid), obstacle.shape, obstacle.X_BO);
    }
    for (const HeldSolid& held : snapshot.held)
      add(held.shape, kinematics.X_BH() * held.X_HO, obstacle.shape, obstacle.X_BO);
  }
  for (const auto& [a, b] : solids.pairs) {
    add(shape(a), kinematics.X_BSolid(a), shape(b), kinematics.X_BSolid(b));
    if (b != solids.hand()) continue;
    for (const HeldSolid& held : snapshot.held)
      add(shape(a), kinematics.X_BSolid(a), held.shape, kinematics.X_BH() * held.X_HO);
  }
  return least;
}

}  // namespace tether::motion
