#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "tether/common/text.h"
#include "tether/evaluation/check.h"
#include "tether/geometry/box_tree.h"
#include "tether/geometry/distance/distance.h"
#include "tether/math/infinity.h"
#include "tether/scene/region.h"
#include "tether/scene/resting_contact.h"

namespace tether::evaluation {
namespace {

constexpr double kTolerance = 1e-3;
constexpr double kTouch = 2e-3;  // The tolerance of FindSupport().

std::string Millimetres(double metres) { return Fixed(1e3 * metres, 1) + " mm"; }

/// Finds contradictions in the geometry of a scene.
class GeometryCheck {
 public:
  explicit GeometryCheck(const scenario::Scenario& scenario)
      : scenario_(scenario), scene_(scenario.scene), poses_(scene::InitialPoses(scenario.scene)) {
    for (const scene::Object& object : scene_.objects) {
      bounds_.push_back(geometry::BoundingBox(object.shape, poses_.at(object.name)));
      objects_[object.name] = &object;
    }
    boxes_ = geometry::BoxTree(bounds_);
    if (scenario_.problem == nullptr) return;
    for (const symbolic::TypedName& object : scenario_.problem->objects) pddl_objects_[object.name] = &object;
  }

  std::vector<std::string> Run() {
    CheckOverlaps();
    CheckFloating();
    if (scenario_.problem != nullptr) CheckInit();
    return std::move(problems_);
  }

 private:
  const scene::Object* Find(const std::string& name) const {
    const auto found = objects_.find(name);
    return found == objects_.end() ? nullptr : found->second;
  }

  scene::Resting Between(const scene::Object& upper, const scene::Object& lower) const {
    return scene::FindResting(upper, poses_.at(upper.name), lower, poses_.at(lower.name));
  }

  void CheckOverlaps() {
    for (size_t i = 0; i < scene_.objects.size(); ++i) {
      for (const size_t j : boxes_.Meeting(Grown(i))) {
        if (j <= i) continue;
        const scene::Object &a = scene_.objects[i], &b = scene_.objects[j];
        if (!a.movable() && !b.movable()) continue;  // furniture may be built into furniture
        const double distance = Between(a, b).distance;
        if (distance < -kTolerance) {
          problems_.push_back("objects '" + a.name + "' and '" + b.name + "' overlap by " +
                              Millimetres(-distance));
        }
      }
    }
  }

  /// Around an object, so that whatever touches it meets it.
  geometry::Aabb Grown(size_t i) const {
    geometry::Aabb box = bounds_[i];
    box.lower.array() -= kTouch;
    box.upper.array() += kTouch;
    return box;
  }

  /// Bounds of the ray from an object's centre of mass downwards.
  geometry::Aabb Below(size_t i) const {
    const scene::Object& object = scene_.objects[i];
    const Eigen::Vector3d centre = poses_.at(object.name) * geometry::CentreOfMass(object.shape);
    return {{centre.x(), centre.y(), -math::kInfinity}, centre};
  }

  bool IsCarried(size_t i) const {
    const std::vector<size_t> near = boxes_.Meeting(Grown(i));
    return std::any_of(near.begin(), near.end(), [&](size_t j) {
      if (j == i) return false;
      const scene::Resting resting = Between(scene_.objects[i], scene_.objects[j]);
      return resting.distance <= kTolerance && (resting.upward || resting.centre_above);
    });
  }

  /// As scene::FindSupport(), among what is near.
  const scene::Object* FindSupport(size_t i) const {
    const scene::Object* best = nullptr;
    double best_distance = kTouch;
    for (const size_t j : boxes_.Meeting(Grown(i))) {
      if (j == i) continue;
      const scene::Resting resting = Between(scene_.objects[i], scene_.objects[j]);
      if (!resting.Holds(kTouch) || std::abs(resting.distance) >= best_distance) continue;
      best = &scene_.objects[j];
      best_distance = std::abs(resting.distance);
    }
    return best;
  }

  void CheckFloating() {
    for (size_t i = 0; i < scene_.objects.size(); ++i) {
      const scene::Object& object = scene_.objects[i];
      if (!object.movable() || IsCarried(i)) continue;
      const scene::Object* below = nullptr;
      double gap = std::numeric_limits<double>::infinity();
      for (const size_t j : boxes_.Meeting(Below(i))) {
        if (j == i) continue;
        const scene::Resting resting = Between(object, scene_.objects[j]);
        if (resting.centre_above && resting.distance < gap) {
          gap = resting.distance;
          below = &scene_.objects[j];
        }
      }
      if (gap <= kTolerance) continue;
      problems_.push_back("object '" + object.name + "' rests on nothing: " +
                          (below != nullptr
                               ? "it is " + Millimetres(gap) + " from '" + below->name + "' below it"
                               : "there is nothing below it"));
    }
  }

  void CheckInit() {
    const symbolic::Problem& problem = *scenario_.problem;
    CheckRegions();
    const int on = problem.domain->FindPredicate("on");
    if (on < 0 || problem.domain->predicates[on].parameters.size() != 2) return;
    std::set<std::pair<std::string, std::string>> stated;
    for (const symbolic::Fact& fact : problem.init) {
      if (fact.predicate != on) continue;
      const std::string& upper = problem.objects[fact.arguments[0]].name;
      const std::string& lower = problem.objects[fact.arguments[1]].name;
      stated.emplace(upper, lower);
      const scene::Object *a = Find(upper), *b = Find(lower);
      if (a != nullptr && b != nullptr) CheckFact(*a, *b, fact.where);
    }
    for (size_t i = 0; i < scene_.objects.size(); ++i) {
      const scene::Object& a = scene_.objects[i];
      const scene::Object* b = a.movable() ? FindSupport(i) : nullptr;
      if (b == nullptr || !CanBeOn(on, a.name, b->name) || stated.contains({a.name, b->name})) continue;
      problems_.push_back("object '" + a.name + "' rests on '" + b->name + "', but :init of " + problem.file +
                          " does not say (on " + a.name + " " + b->name + ")");
    }
  }

  /// Facts in(object, region) and in(object, group) against where the objects are.
  void CheckRegions() {
    const symbolic::Problem& problem = *scenario_.problem;
    const int in = problem.domain->FindPredicate("in");
    if (in < 0 || problem.domain->predicates[in].parameters.size() != 2) return;
    for (const symbolic::Fact& fact : problem.init) {
      if (fact.predicate != in) continue;
      const std::string& name = problem.objects[fact.arguments[0]].name;
      const std::string& area = problem.objects[fact.arguments[1]].name;
      const scene::Object* object = Find(name);
      const bool is_area = scene_.FindRegion(area) != nullptr || scene_.groups.contains(area);
      if (object == nullptr || !is_area || scene::IsIn(scene_, poses_, *object, area)) continue;
      problems_.push_back(fact.where.ToString() + ": (in " + name + " " + area +
                          ") disagrees with the scene: the footprint of '" + name + "' is not within '" +
                          area + "', or it does not stand there");
    }
  }

  void CheckFact(const scene::Object& a, const scene::Object& b, const Location& where) {
    const scene::Resting resting = Between(a, b);
    if (resting.Holds(kTolerance)) return;
    std::string reason;
    if (std::abs(resting.distance) > kTolerance) {
      reason = resting.distance > 0 ? "they are " + Millimetres(resting.distance) + " apart"
                                    : "they overlap by " + Millimetres(-resting.distance);
    } else {
      reason = resting.upward ? "its centre of mass is not above '" + b.name + "'"
                              : "it is not above '" + b.name + "'";
    }
    problems_.push_back(where.ToString() + ": (on " + a.name + " " + b.name +
                        ") disagrees with the scene: " + reason);
  }

  /// Whether the types of the predicate allow (on a b).
  bool CanBeOn(int on, const std::string& a, const std::string& b) const {
    const symbolic::Problem& problem = *scenario_.problem;
    const auto& parameters = problem.domain->predicates[on].parameters;
    const auto upper = pddl_objects_.find(a), lower = pddl_objects_.find(b);
    return upper != pddl_objects_.end() && lower != pddl_objects_.end() &&
           problem.domain->Fits(upper->second->types, parameters[0].types) &&
           problem.domain->Fits(lower->second->types, parameters[1].types);
  }

  const scenario::Scenario& scenario_;
  const scene::Scene& scene_;
  std::map<std::string, math::Pose> poses_;
  std::vector<geometry::Aabb> bounds_;  // Of the objects, in the world.
  geometry::BoxTree boxes_;
  std::map<std::string, const scene::Object*> objects_;
  std::map<std::string, const symbolic::TypedName*> pddl_objects_;
  std::vector<std::string> problems_;
};

}  // namespace

std::vector<std::string> CheckGeometry(const scenario::Scenario& scenario) {
  return GeometryCheck(scenario).Run();
}

}  // namespace tether::evaluation
