#include "tether/motion/start_check.h"

#include <optional>

#include "tether/geometry/distance/distance.h"
#include "tether/robot/kinematics.h"

namespace tether::motion {
namespace {

// m
constexpr double kOverlap = 0.001, kBaseOverlap = 0.005;

}  // namespace

std::vector<Touch> FindOverlaps(const Snapshot& snapshot, const Eigen::VectorXd& q) {
  std::vector<Touch> touches;
  for (const robot::LinkSolid& link : snapshot.model->solids().links) {
    if (link.link != 0) continue;
    for (const Obstacle& obstacle : snapshot.obstacles) {
      const double distance =
          geometry::SignedDistance(link.shape, math::Pose(), obstacle.shape, obstacle.X_BO).distance;
      if (distance < -kBaseOverlap) touches.push_back({link.name, obstacle.name, distance});
    }
  }
  Snapshot close = snapshot;
  close.clearance = 0;
  const std::optional<Touch> worst = CollisionScene::Compile(close)->FindTouch(q);
  if (worst && worst->distance < -kOverlap) touches.push_back(*worst);
  return touches;
}

void AddArm(const std::string& name, const robot::Model& model, const Eigen::VectorXd& q,
            const math::Pose& X_BOther, std::vector<Obstacle>* obstacles) {
  const robot::LinkPoses poses(model.chain(), q);
  for (const robot::LinkSolid& link : model.solids().links)
    obstacles->push_back({name + "'s " + link.name, link.shape, X_BOther * poses.X_BL(link.link)});
  obstacles->push_back(
      {name + "'s hand", model.HandShape(model.gripper().max_opening), X_BOther * poses.X_BH()});
}

}  // namespace tether::motion
