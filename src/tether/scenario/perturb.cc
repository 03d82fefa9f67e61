#include "tether/scenario/perturb.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "tether/common/random.h"
#include "tether/geometry/distance/distance.h"
#include "tether/scene/resting_contact.h"

namespace tether::scenario {
namespace {

constexpr int kDraws = 100;
constexpr double kOverlap = 1e-4;

math::Pose Displace(const math::Pose& X, const Eigen::Vector3d& translation, double yaw) {
  return {math::RotationFromRpy({0, 0, yaw}) * X.R, X.p + translation};
}

/// Places the objects one by one, supports before what they carry.
class Perturber {
 public:
  Perturber(const scene::Scene& scene, const Perturbation& perturb, uint64_t seed)
      : scene_(scene),
        perturb_(perturb),
        random_(Random(seed).Split("perturb")),
        before_(scene::InitialPoses(scene)) {
    for (const scene::Object& object : scene.objects)
      support_[object.name] = scene::FindSupport(scene, before_, object);
  }

  scene::Scene Run() {
    for (const scene::Object& object : scene_.objects) Place(object);
    scene::Scene result = scene_;
    for (scene::Object& object : result.objects) {
      if (object.movable()) {
        // Parents may be regions, robots or fixed objects, which stay, or movable objects, whose new poses
        // are known.
        const math::Pose X_WP =
            after_.contains(object.parent) ? after_.at(object.parent) : scene_.InitialPose(object.parent);
        object.X_ParentObject = math::Between(X_WP, after_.at(object.name));
      }
    }
    return result;
  }

 private:
  void Place(const scene::Object& object) {
    if (after_.contains(object.name)) return;
    const math::Pose& X_before = before_.at(object.name);
    if (!object.movable()) {
      after_[object.name] = X_before;
      return;
    }
    const scene::Object* support = support_.at(object.name);
    math::Pose X_carried = X_before;
    if (support != nullptr && support->movable() && placing_.insert(object.name).second) {
      Place(*support);
      X_carried = after_.at(support->name) * math::Between(before_.at(support->name), X_before);
    }
    Random random = random_.Split(object.name);
    for (int draw = 0; draw < kDraws; ++draw) {
      const double radius = perturb_.position * std::sqrt(random.Uniform(0, 1));
      const double direction = random.Uniform(0, 2 * std::numbers::pi);
      const double yaw = random.Uniform(-perturb_.rotation, perturb_.rotation);
      const math::Pose X =
          Displace(X_carried, {radius * std::cos(direction), radius * std::sin(direction), 0}, yaw);
      if (!Fits(object, support, X)) continue;
      after_[object.name] = X;
      return;
    }
    after_[object.name] = X_carried;
  }

  bool Fits(const scene::Object& object, const scene::Object* support, const math::Pose& X) const {
    if (support != nullptr &&
        !scene::FindResting(object, X, *support, after_or_before(support->name)).Holds(2e-3)) {
      return false;
    }
    for (const scene::Object& other : scene_.objects) {
      if (other.name == object.name || &other == support || CarriedBy(other, object)) continue;
      const double now =
          geometry::SignedDistance(object.shape, X, other.shape, after_or_before(other.name)).distance;
      const double then =
          geometry::SignedDistance(object.shape, before_.at(object.name), other.shape, before_.at(other.name))
              .distance;
      if (now < -kOverlap && now < then - kOverlap) return false;
    }
    return true;
  }

  /// Whether `object` stands, perhaps over others, on `below`: then it moves along.
  bool CarriedBy(const scene::Object& object, const scene::Object& below) const {
    const scene::Object* support = support_.at(object.name);
    for (size_t i = 0; support != nullptr && i < scene_.objects.size(); ++i) {
      if (support->name == below.name) return true;
      support = support_.at(support->name);
    }
    return false;
  }

  const math::Pose& after_or_before(const std::string& name) const {
    const auto found = after_.find(name);
    return found == after_.end() ? before_.at(name) : found->second;
  }

  const scene::Scene& scene_;
  const Perturbation& perturb_;
  Random random_;
  std::map<std::string, math::Pose> before_;
  std::map<std::string, math::Pose> after_;
  std::map<std::string, const scene::Object*> support_;
  std::set<std::string> placing_;
};

}  // namespace

scene::Scene PerturbScene(const scene::Scene& scene, const Perturbation& perturb, uint64_t seed) {
  if (perturb.position <= 0 && perturb.rotation <= 0) return scene;
  return Perturber(scene, perturb, seed).Run();
}

}  // namespace tether::scenario
