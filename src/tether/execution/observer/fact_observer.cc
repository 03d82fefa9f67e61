#include "tether/execution/observer/fact_observer.h"

#include <map>

#include "tether/geometry/distance/bounds.h"
#include "tether/scene/region.h"
#include "tether/scene/resting_contact.h"

namespace tether::execution {
namespace {

std::string TextOf(const symbolic::Problem& problem, const symbolic::Fact& fact) {
  std::string text = problem.domain->predicates[ToIndex(fact.predicate)].name + "(";
  for (const int argument : fact.arguments) {
    if (text.back() != '(') text += ',';
    text += problem.objects[ToIndex(argument)].name;
  }
  return text + ")";
}

}  // namespace

FactObserver::FactObserver(const scene::Scene& scene, const symbolic::Problem& problem,
                           const FactObserverOptions& options)
    : scene_(scene), options_(options) {
  const symbolic::Domain& domain = *problem.domain;
  const auto fits = [&](int object, const symbolic::TypedName& parameter) {
    return domain.Fits(problem.objects[ToIndex(object)].types, parameter.types);
  };
  for (size_t p = 0; p < domain.predicates.size(); ++p) {
    const symbolic::Predicate& predicate = domain.predicates[p];
    const size_t arity = predicate.parameters.size();
    const bool on = predicate.name == "on" && arity == 2, in = predicate.name == "in" && arity == 2;
    if (!on && !in && !(predicate.name == "inhand" && arity == 1)) continue;
    for (int a = 0; a < static_cast<int>(problem.objects.size()); ++a) {
      ObservableFact one;
      one.fact.predicate = static_cast<int>(p);
      one.fact.arguments = {a};
      one.object = scene.FindObjectId(problem.objects[ToIndex(a)].name);
      if (!one.object.valid() || !fits(a, predicate.parameters[0])) continue;
      one.kind = on   ? ObservableFact::Kind::kOn
                 : in ? ObservableFact::Kind::kIn
                      : ObservableFact::Kind::kInHand;
      if (arity == 1) {
        one.text = TextOf(problem, one.fact);
        facts_.push_back(one);
        continue;
      }
      for (int b = 0; b < static_cast<int>(problem.objects.size()); ++b) {
        if (a == b || !fits(b, predicate.parameters[1])) continue;
        const std::string& name = problem.objects[ToIndex(b)].name;
        one.fact.arguments = {a, b};
        one.below = scene.FindObjectId(name);
        one.area = name;
        const bool known =
            on ? one.below.valid() : scene.FindRegion(name) != nullptr || scene.groups.contains(name);
        if (!known) continue;
        one.text = TextOf(problem, one.fact);
        facts_.push_back(one);
      }
    }
  }
}

bool FactObserver::IsSeen(const ObservableFact& fact,
                          const IndexedVector<ObjectId, control::MovingPose>& objects, ObjectId held) const {
  if (fact.kind == ObservableFact::Kind::kInHand) return held == fact.object;
  if (held == fact.object) return false;
  const scene::Object& body = scene_.object(fact.object);
  const math::Pose& X_WA = objects[fact.object].X;
  if (fact.kind == ObservableFact::Kind::kIn) {
    std::map<std::string, math::Pose> X_WO;
    for (const ObjectId i : objects.ids()) X_WO[scene_.object(i).name] = objects[i].X;
    return scene::IsIn(scene_, X_WO, body, fact.area);
  }
  const scene::Object& support = scene_.object(fact.below);
  const math::Pose& X_WB = objects[fact.below].X;
  if (geometry::DistanceLowerBound(body.shape, X_WA, support.shape, X_WB) > options_.contact) return false;
  if (!scene::FindResting(body, X_WA, support, X_WB).Holds(options_.contact)) return false;
  return scene::FindLean(body.shape, -X_WA.R.transpose().col(2)) <= options_.lean;
}

bool FactObserver::Look(double time, const IndexedVector<ObjectId, control::MovingPose>& objects,
                        ObjectId held, bool at_once) {
  if (started_ && !at_once && time < next_ - 1e-9) return false;
  next_ = time + options_.period;
  for (ObservableFact& fact : facts_) {
    const bool seen = IsSeen(fact, objects, held);
    if (!started_ || seen != fact.seen) fact.since = time;
    fact.seen = seen;
    if (!started_ || time >= fact.since + options_.debounce - 1e-9) fact.value = seen;
  }
  started_ = true;
  return true;
}

}  // namespace tether::execution
