#include "tether/sim/box_collision.h"

#include <cmath>
#include <mutex>

#include <mujoco/mujoco.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "tether/math/so3.h"

namespace tether::sim {
namespace {

using Rotation = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Edges closer to parallel than this, in rad, are turned apart by ten times as much: far outside the range
// where the collision function fails, and far below anything that a contact can feel.
constexpr double kTooParallel = 1e-10;

mjfCollision unguarded = nullptr;

bool TooParallel(const Rotation& R_WA, const Rotation& R_WB) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (R_WA.col(i).cross(R_WB.col(j)).squaredNorm() < kTooParallel * kTooParallel) return true;
    }
  }
  return false;
}

int GuardedBoxBox(const mjModel* model, const mjData* data, mjContact* contacts, int geom_a, int geom_b,
                  mjtNum margin) {
  const Eigen::Map<const Rotation> R_WA(data->geom_xmat + 9 * geom_a);
  // The data is our caller's and not const there; the matrix is as it was when we return.
  Eigen::Map<Rotation> R_WB(const_cast<mjtNum*>(data->geom_xmat) + 9 * geom_b);
  if (!TooParallel(R_WA, R_WB)) return unguarded(model, data, contacts, geom_a, geom_b, margin);
  const Rotation kept = R_WB;
  // A turn about the diagonal moves all three axes alike.
  for (double angle = 10 * kTooParallel; angle < 1e-7 && TooParallel(R_WA, R_WB); angle *= 3) {
    R_WB = kept * math::ExpSO3(Eigen::Vector3d::Constant(angle));
  }
  const int count = unguarded(model, data, contacts, geom_a, geom_b, margin);
  R_WB = kept;
  return count;
}

}  // namespace

void GuardBoxCollision() {
  static std::once_flag once;
  std::call_once(once, [] {
    unguarded = mjCOLLISIONFUNC[mjGEOM_BOX][mjGEOM_BOX];
    mjCOLLISIONFUNC[mjGEOM_BOX][mjGEOM_BOX] = GuardedBoxBox;
  });
}

}  // namespace tether::sim
