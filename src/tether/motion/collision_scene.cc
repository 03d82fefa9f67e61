#include "tether/motion/collision_scene.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "tether/common/text.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/distance/distance.h"
#include "tether/geometry/distance/query.h"
#include "tether/motion/kernel/kernel_tables.h"
#include "tether/robot/kinematics.h"

namespace tether::motion {
namespace {

using Eigen::Vector3d;

// Parts further apart than the arm reaches by this are never checked, m.
constexpr double kBeyondReach = 0.01;

/// Upper bounds of the distance of a part's points from each joint's axis: along the chain, the lengths
/// between the joints' origins add up.
std::vector<double> ReachFromAxes(const robot::Chain& chain, int link, const geometry::Part& part) {
  std::vector<double> reach(static_cast<size_t>(chain.dof()), 0.0);
  const double radius = geometry::BoundingRadius(part.primitive);
  double from_origin = 0;
  for (int j = link; j >= 1; --j) {
    // The part's middle or the next joint, in the frame of joint j, whose axis is z.
    const Vector3d p = j == link ? part.X_SP.p : chain.joints[static_cast<size_t>(j)].X_PJ.p;
    const double beyond = j == link ? radius : from_origin;
    reach[static_cast<size_t>(j) - 1] = std::hypot(p.x(), p.y()) + beyond;
    from_origin = p.norm() + beyond;
  }
  return reach;
}

/// How far from joint 1's origin any point of the part can be, m.
double ReachFromShoulder(const robot::Chain& chain, int link, const geometry::Part& part) {
  double reach = part.X_SP.p.norm() + geometry::BoundingRadius(part.primitive);
  for (int j = link; j >= 2; --j) reach += chain.joints[static_cast<size_t>(j) - 1].X_PJ.p.norm();
  return reach;
}

}  // namespace

std::string Touch::Text() const {
  const std::string mm = Fixed(1e3 * std::abs(distance), 2) + " mm";
  return a + (distance < 0 ? " is " + mm + " inside " : " is " + mm + " from ") + b;
}

std::shared_ptr<const CollisionScene> CollisionScene::Compile(const Snapshot& snapshot) {
  return std::shared_ptr<const CollisionScene>(new CollisionScene(snapshot));
}

CollisionScene::CollisionScene(const Snapshot& snapshot)
    : model_(snapshot.model), clearance_(snapshot.clearance) {
  assert(model_ != nullptr);
  AddObstacles(snapshot);
  AddArm(snapshot);
  AddPairs();
  tables_ = std::make_unique<internal::KernelTables>(internal::MakeKernelTables(*this));
}

CollisionScene::~CollisionScene() = default;

void CollisionScene::AddObstacles(const Snapshot& snapshot) {
  for (const Obstacle& obstacle : snapshot.obstacles) {
    const int index = static_cast<int>(obstacle_names_.size());
    obstacle_names_.push_back(obstacle.name);
    for (const geometry::Part& part : obstacle.shape.parts)
      obstacles_.push_back({index, part.primitive, obstacle.X_BO * part.X_SP});
  }
}

void CollisionScene::AddArm(const Snapshot& snapshot) {
  const robot::ArmSolids& solids = model_->solids();
  const robot::Chain& chain = model_->chain();
  const auto add = [&](const std::string& name, int link, const geometry::Shape& shape,
                       const math::Pose& X_LS) {
    const int body = static_cast<int>(body_names_.size());
    body_names_.push_back(name);
    for (const geometry::Part& part : shape.parts) AddPart(body, link, {part.primitive, X_LS * part.X_SP});
  };
  for (const robot::LinkSolid& link : solids.links) add(link.name, link.link, link.shape, math::Pose());
  num_links_ = static_cast<int>(body_names_.size());
  add("hand", chain.dof(), model_->HandShape(snapshot.opening), chain.X_LH);
  for (const HeldSolid& held : snapshot.held) add(held.name, chain.dof(), held.shape, chain.X_LH * held.X_HO);
}

void CollisionScene::AddPart(int body, int link, const geometry::Part& part) {
  const robot::Chain& chain = model_->chain();
  ArmPart added{body,
                link,
                part.primitive,
                part.X_SP,
                geometry::BoundingRadius(part.primitive),
                {},
                ReachFromAxes(chain, link, part)};
  const Vector3d shoulder = chain.joints.front().X_PJ.p;
  const double reach = ReachFromShoulder(chain, link, part) + clearance_ + kBeyondReach;
  for (size_t i = 0; link > 0 && i < obstacles_.size(); ++i) {
    const ObstaclePart& obstacle = obstacles_[i];
    if (geometry::DistanceToPoint(obstacle.primitive, obstacle.X_BP, shoulder).distance < reach)
      added.obstacles.push_back(static_cast<int>(i));
  }
  arm_.push_back(std::move(added));
}

void CollisionScene::AddPairs() {
  const auto checked = [&](int a, int b) {
    const auto& pairs = model_->solids().pairs;
    return std::find(pairs.begin(), pairs.end(), std::pair(a, b)) != pairs.end();
  };
  for (int a = 0; a < static_cast<int>(arm_.size()); ++a) {
    for (int b = a + 1; b < static_cast<int>(arm_.size()); ++b) {
      const int body_a = arm_[static_cast<size_t>(a)].body, body_b = arm_[static_cast<size_t>(b)].body;
      // What is held moves with the hand.
      if (body_a < num_links_ && checked(body_a, std::min(body_b, num_links_))) pairs_.push_back({a, b});
    }
  }
}

std::optional<Touch> CollisionScene::FindTouch(const Eigen::VectorXd& q) const {
  const robot::LinkPoses poses(model_->chain(), q);
  std::optional<Touch> worst;
  const auto add = [&](const std::string& a, const std::string& b, double distance) {
    if (distance > clearance_ || (worst && worst->distance <= distance)) return;
    worst = Touch{a, b, distance};
  };
  const auto place = [&](const ArmPart& part) { return poses.X_BL(part.link) * part.X_LP; };
  for (const ArmPart& part : arm_) {
    const math::Pose X_BP = place(part);
    for (const int i : part.obstacles) {
      const ObstaclePart& other = obstacles_[static_cast<size_t>(i)];
      // The part's bounding ball spares most distances.
      const auto middle = geometry::DistanceToPoint(other.primitive, other.X_BP, X_BP.p);
      if (middle.distance > part.radius + clearance_) continue;
      add(body_name(part.body), obstacle_name(other.obstacle),
          geometry::SignedDistance(part.primitive, X_BP, other.primitive, other.X_BP).distance);
    }
  }
  for (const PartPair& pair : pairs_) {
    const ArmPart &a = arm_[static_cast<size_t>(pair.a)], &b = arm_[static_cast<size_t>(pair.b)];
    if ((place(a).p - place(b).p).norm() > a.radius + b.radius + clearance_) continue;
    add(body_name(b.body), body_name(a.body),
        geometry::SignedDistance(a.primitive, place(a), b.primitive, place(b)).distance);
  }
  return worst;
}

}  // namespace tether::motion
