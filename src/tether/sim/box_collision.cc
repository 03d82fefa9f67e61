#include "tether/sim/box_collision.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include <mujoco/mujoco.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "tether/geometry/distance/distance.h"
#include "tether/math/so3.h"

namespace tether::sim {
namespace {

using Rotation = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Edges closer to parallel than this, in rad, are turned apart by ten times as much: far outside the range
// where the collision function fails, and far below anything that a contact can feel.
constexpr double kTooParallel = 1e-10;

// Contacts that are deeper than the boxes overlap by more than this are wrong, m.
constexpr double kFalseDepth = 1e-3;

mjfCollision unguarded = nullptr;

bool TooParallel(const Rotation& R_WA, const Rotation& R_WB) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (R_WA.col(i).cross(R_WB.col(j)).squaredNorm() < kTooParallel * kTooParallel) return true;
    }
  }
  return false;
}

struct PosedBox {
  geometry::Box box;
  math::Pose X_WB;
};

PosedBox BoxOf(const mjModel* model, const mjData* data, int geom) {
  PosedBox posed;
  posed.box.size = 2 * Eigen::Map<const Eigen::Vector3d>(model->geom_size + 3 * geom);
  posed.X_WB.R = Eigen::Map<const Rotation>(data->geom_xmat + 9 * geom);
  posed.X_WB.p = Eigen::Map<const Eigen::Vector3d>(data->geom_xpos + 3 * geom);
  return posed;
}

/// How far the boxes overlap along a direction, m.
double OverlapAlong(const Eigen::Vector3d& n_W, const PosedBox& a, const PosedBox& b) {
  const double reach_a = 0.5 * (a.X_WB.R.transpose() * n_W).cwiseAbs().dot(a.box.size);
  const double reach_b = 0.5 * (b.X_WB.R.transpose() * n_W).cwiseAbs().dot(b.box.size);
  return reach_a + reach_b - std::abs(n_W.dot(b.X_WB.p - a.X_WB.p));
}

/// No contact is deeper than the boxes overlap, and none points in a direction in which they overlap by much
/// more.
bool Believable(const mjContact* contacts, int count, const PosedBox& a, const PosedBox& b) {
  const double depth = -geometry::SignedDistance(a.box, a.X_WB, b.box, b.X_WB).distance;
  for (int i = 0; i < count; ++i) {
    const Eigen::Map<const Eigen::Vector3d> n_W(contacts[i].frame);
    if (-contacts[i].dist > depth + kFalseDepth || OverlapAlong(n_W, a, b) > depth + kFalseDepth)
      return false;
  }
  return true;
}

int GuardedBoxBox(const mjModel* model, const mjData* data, mjContact* contacts, int geom_a, int geom_b,
                  mjtNum margin) {
  const Eigen::Map<const Rotation> R_WA(data->geom_xmat + 9 * geom_a);
  // The data is our caller's and not const there; the matrix is as it was when we return.
  Eigen::Map<Rotation> R_WB(const_cast<mjtNum*>(data->geom_xmat) + 9 * geom_b);
  const Rotation kept = R_WB;
  const PosedBox a = BoxOf(model, data, geom_a), b = BoxOf(model, data, geom_b);
  int count = TooParallel(R_WA, R_WB) ? -1 : unguarded(model, data, contacts, geom_a, geom_b, margin);
  if (count >= 0 && Believable(contacts, count, a, b)) return count;
  for (double angle = 10 * kTooParallel; angle < 1e-4; angle *= 3) {
    // A turn about the diagonal moves all three axes alike.
    R_WB = kept * math::ExpSO3(Eigen::Vector3d::Constant(angle));
    if (TooParallel(R_WA, R_WB)) continue;
    count = unguarded(model, data, contacts, geom_a, geom_b, margin);
    if (Believable(contacts, count, a, b)) break;
    count = 0;
  }
  R_WB = kept;
  return std::max(count, 0);
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
