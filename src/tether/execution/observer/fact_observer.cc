#include "tether/execution/observer/fact_observer.h"

#include <utility>

#include "tether/geometry/distance/bounds.h"
#include "tether/scene/region.h"
#include "tether/scene/resting_contact.h"

namespace tether::execution {

Observable FindObservable(const scene::Scene& scene, const std::string& predicate,
                          const std::vector<std::string>& arguments) {
  const bool on = predicate == "on", in = predicate == "in";
  if (!on && !in && predicate != "inhand") return Observable::kNothing;
  if (arguments.size() != (on || in ? 2 : 1) || scene.FindObject(arguments[0]) == nullptr)
    return Observable::kNothing;
  if (on) return scene.FindObject(arguments[1]) != nullptr ? Observable::kOn : Observable::kNothing;
  if (!in) return Observable::kInHand;
  const bool is_area = scene.FindRegion(arguments[1]) != nullptr || scene.groups.contains(arguments[1]);
  return is_area ? Observable::kIn : Observable::kNothing;
}

FactObserver::FactObserver(const scene::Scene& scene, const symbolic::Task& task,
                           const FactObserverOptions& options)
    : scene_(scene), options_(options) {
  const symbolic::Problem& problem = task.problem();
  const symbolic::Domain& domain = task.domain();
  const auto add = [&](int predicate, const std::vector<int>& arguments) {
    const symbolic::Predicate& declared = domain.predicates[ToIndex(predicate)];
    std::vector<std::string> names;
    for (size_t i = 0; i < arguments.size(); ++i) {
      const symbolic::TypedName& object = problem.objects[ToIndex(arguments[i])];
      if (!domain.Fits(object.types, declared.parameters[i].types)) return;
      names.push_back(object.name);
    }
    ObservableFact one;
    one.kind = FindObservable(scene, declared.name, names);
    if (one.kind == Observable::kNothing) return;
    one.fact = {predicate, arguments, {}};
    one.text = task.AtomName({predicate, arguments});
    one.object = scene.FindObjectId(names[0]);
    if (one.kind == Observable::kOn) one.below = scene.FindObjectId(names[1]);
    if (one.kind == Observable::kIn) one.area = names[1];
    has_regions_ = has_regions_ || one.kind == Observable::kIn;
    facts_.push_back(std::move(one));
  };
  const int count = static_cast<int>(problem.objects.size());
  for (int p = 0; p < static_cast<int>(domain.predicates.size()); ++p) {
    const size_t arity = domain.predicates[ToIndex(p)].parameters.size();
    if (arity != 1 && arity != 2) continue;
    for (int a = 0; a < count; ++a) {
      if (arity == 1) add(p, {a});
      for (int b = 0; arity == 2 && b < count; ++b) {
        if (a != b) add(p, {a, b});
      }
    }
  }
}

void FactObserver::TakePoses(const IndexedVector<ObjectId, control::MovingPose>& objects) {
  for (const ObjectId i : objects.ids()) {
    if (has_regions_) X_WO_[scene_.object(i).name] = objects[i].X;
  }
}

bool FactObserver::IsSeen(const ObservableFact& fact,
                          const IndexedVector<ObjectId, control::MovingPose>& objects, ObjectId held) const {
  if (fact.kind == Observable::kInHand) return held == fact.object;
  if (held == fact.object || !objects[fact.object].seen) return false;
  const scene::Object& body = scene_.object(fact.object);
  if (fact.kind == Observable::kIn) return scene::IsIn(scene_, X_WO_, body, fact.area);
  const math::Pose& X_WA = objects[fact.object].X;
  const scene::Object& support = scene_.object(fact.below);
  const math::Pose& X_WB = objects[fact.below].X;
  return geometry::DistanceLowerBound(body.shape, X_WA, support.shape, X_WB) <= options_.contact &&
         scene::StandsOn(body, X_WA, support, X_WB, options_.contact, options_.lean);
}

bool FactObserver::Look(double time, const IndexedVector<ObjectId, control::MovingPose>& objects,
                        ObjectId held, bool at_once) {
  if (started_ && !at_once && time < next_ - 1e-9) return false;
  next_ = time + options_.period;
  TakePoses(objects);
  for (ObservableFact& fact : facts_) {
    const bool seen = IsSeen(fact, objects, held);
    if (!started_ || seen != fact.seen) fact.since = time;
    fact.seen = seen;
    const double debounce = exact_ ? options_.exact_debounce : options_.debounce;
    if (!started_ || time >= fact.since + debounce - 1e-9) fact.value = seen;
  }
  started_ = true;
  return true;
}

}  // namespace tether::execution
