#include "tether/scene/resting_contact.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/distance/distance.h"
#include "tether/geometry/distance/query.h"
#include "tether/geometry/polygon/support.h"

namespace tether::scene {
namespace {

constexpr double kTouch = 2e-3;
// A body tips in steps of this angle, rad, at most so many, by lowering its centre of mass by more than this,
// m.
constexpr double kTipStep = 0.005;
constexpr int kTipSteps = 40, kTipDirections = 24;
constexpr double kLevel = 1e-9;

}  // namespace

Resting FindResting(const scene::Object& upper, const math::Pose& X_WUpper, const scene::Object& lower,
                    const math::Pose& X_WLower) {
  const geometry::Distance distance = geometry::SignedDistance(lower.shape, X_WLower, upper.shape, X_WUpper);
  Resting resting;
  resting.distance = distance.distance;
  resting.upward = distance.n_W.z() > std::sqrt(0.5);
  const Eigen::Vector3d centre = X_WUpper * geometry::CentreOfMass(upper.shape);
  resting.centre_above =
      geometry::CastRay(lower.shape, X_WLower, centre, -Eigen::Vector3d::UnitZ(), geometry::RayStart::kIgnore)
          .has_value();
  return resting;
}

double FindLean(const geometry::Shape& shape, const Eigen::Vector3d& down) {
  // On a plane, the height of the centre of mass is the support function less its own part; it tips downhill.
  const Eigen::Vector3d centre = geometry::CentreOfMass(shape);
  const auto height = [&](const Eigen::Vector3d& d) { return geometry::Support(shape, d) - d.dot(centre); };
  const Eigen::Vector3d start = down.normalized();
  Eigen::Vector3d d = start;
  double lowest = height(d);
  for (int step = 0; step < kTipSteps; ++step) {
    // The height has edges, along which its gradient does not help: the best of many directions is used.
    const Eigen::Vector3d across = d.unitOrthogonal(), other = d.cross(across);
    Eigen::Vector3d best = d;
    for (int k = 0; k < kTipDirections; ++k) {
      const double angle = 2 * std::numbers::pi * k / kTipDirections;
      const Eigen::Vector3d next =
          (d + kTipStep * (std::cos(angle) * across + std::sin(angle) * other)).normalized();
      const double then = height(next);
      if (then >= lowest - kLevel) continue;
      lowest = then;
      best = next;
    }
    if (best == d) break;
    d = best;
  }
  return std::atan2(d.cross(start).norm(), d.dot(start));
}

bool StandsOn(const scene::Object& upper, const math::Pose& X_WUpper, const scene::Object& lower,
              const math::Pose& X_WLower, double contact, double lean) {
  return FindResting(upper, X_WUpper, lower, X_WLower).Holds(contact) &&
         FindLean(upper.shape, -X_WUpper.R.transpose().col(2)) <= lean;
}

std::map<std::string, math::Pose> InitialPoses(const scene::Scene& scene) {
  std::map<std::string, math::Pose> poses;
  // By name first: a chain of parents is followed by looking names up.
  std::map<std::string, const scene::Object*> by_name;
  for (const scene::Object& object : scene.objects) by_name.emplace(object.name, &object);
  for (const scene::Object& object : scene.objects) {
    std::vector<const scene::Object*> chain;  // those without a pose yet, the outermost last
    const scene::Object* one = &object;
    while (one != nullptr && !poses.contains(one->name)) {
      chain.push_back(one);
      const auto parent = by_name.find(one->parent);
      one = parent == by_name.end() ? nullptr : parent->second;
    }
    for (; !chain.empty(); chain.pop_back()) {
      const scene::Object& next = *chain.back();
      const auto parent = poses.find(next.parent);
      poses[next.name] =
          (parent != poses.end() ? parent->second : scene.InitialPose(next.parent)) * next.X_ParentObject;
    }
  }
  return poses;
}

const scene::Object* FindSupport(const scene::Scene& scene, const std::map<std::string, math::Pose>& X_WO,
                                 const scene::Object& object) {
  const scene::Object* best = nullptr;
  double best_distance = kTouch;
  for (const scene::Object& other : scene.objects) {
    if (other.name == object.name) continue;
    const Resting resting = FindResting(object, X_WO.at(object.name), other, X_WO.at(other.name));
    if (!resting.Holds(kTouch) || std::abs(resting.distance) >= best_distance) continue;
    best = &other;
    best_distance = std::abs(resting.distance);
  }
  return best;
}

scene::Scene WithCarriers(const scene::Scene& scene) {
  const std::map<std::string, math::Pose> X_WO = InitialPoses(scene);
  std::map<std::string, geometry::Aabb> boxes;
  for (const scene::Object& object : scene.objects)
    boxes[object.name] = geometry::BoundingBox(object.shape, X_WO.at(object.name));
  scene::Scene hung = scene;
  for (size_t i = 0; i < scene.objects.size(); ++i) {
    const scene::Object& object = scene.objects[i];
    const scene::Object* parent = scene.FindObject(object.parent);
    // What a hand holds stays there.
    if (!object.movable() || (parent == nullptr && object.parent != scene::kWorld)) continue;
    const bool near_movable =
        std::any_of(scene.objects.begin(), scene.objects.end(), [&](const scene::Object& other) {
          return other.movable() && other.name != object.name &&
                 boxes.at(other.name).DistanceTo(boxes.at(object.name)) <= kTouch;
        });
    if (!near_movable && (parent == nullptr || !parent->movable())) continue;
    const scene::Object* support = FindSupport(scene, X_WO, object);
    if (support == nullptr || support == parent) continue;
    if (!support->movable() && (parent == nullptr || !parent->movable())) continue;
    // Two objects don't carry each other.
    const scene::Object* below = hung.FindObject(support->name);
    while (below != nullptr && below->name != object.name) below = hung.FindObject(below->parent);
    if (below != nullptr) continue;
    hung.objects[i].parent = support->name;
    hung.objects[i].X_ParentObject = math::Between(X_WO.at(support->name), X_WO.at(object.name));
  }
  return hung;
}

}  // namespace tether::scene
