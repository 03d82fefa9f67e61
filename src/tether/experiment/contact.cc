#include "tether/experiment/contact.h"

#include <cmath>
#include <vector>

#include "tether/geometry/distance.h"
#include "tether/geometry/query.h"

namespace tether::experiment {
namespace {

constexpr double kTouch = 2e-3;

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

}  // namespace tether::experiment
