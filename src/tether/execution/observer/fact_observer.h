#pragma once

#include <map>
#include <string>
#include <vector>

#include "tether/common/id.h"
#include "tether/control/arm_bodies.h"
#include "tether/scene/scene.h"
#include "tether/symbolic/grounding/task.h"

namespace tether::execution {

/// What poses and the hand tell of a ground atom: `on` of two objects, `in` of an object and a region or
/// group, `inhand` of an object; of all others nothing.
enum class Observable { kNothing, kOn, kIn, kInHand };
/// By the names of predicate and arguments, and what these are in the scene.
Observable FindObservable(const scene::Scene& scene, const std::string& predicate,
                          const std::vector<std::string>& arguments);

/// A ground fact that is observable.
struct ObservableFact {
  Observable kind = Observable::kOn;
  symbolic::Fact fact;
  std::string text;    ///< "on(box,shelf)"
  ObjectId object;     ///< What is on, in or in the hand.
  ObjectId below;      ///< kOn: what it is on.
  std::string area;    ///< kIn: the region or group.
  bool seen = false;   ///< As it was looked at last.
  double since = 0;    ///< It has been seen like that since then, s.
  bool value = false;  ///< As it has been seen for the time of debouncing at least.
};

struct FactObserverOptions {
  double period = 0.01;          ///< Between looks, s.
  double debounce = 0.15;        ///< A change counts once it has been seen for so long, s …
  double exact_debounce = 0.01;  ///< … or for so long where poses are exact and not late.
  double contact = 6e-3;         ///< What is on something is in contact with it to within this, m.
  double lean = 0.15;            ///< What leans more than this is not on, rad.
};

/// Watches which facts hold, from the estimated poses and from what the hand holds. All other predicates are
/// not observable: their values follow from the actions' effects.
class FactObserver {
 public:
  /// The facts are those that the types of the task's problem allow. The scene must outlive the observer.
  FactObserver(const scene::Scene& scene, const symbolic::Task& task,
               const FactObserverOptions& options = {});

  /// Looks when the period is over, or at once. True if it has looked. The first look sets all values.
  bool Look(double time, const IndexedVector<ObjectId, control::MovingPose>& objects, ObjectId held,
            bool at_once = false);

  const std::vector<ObservableFact>& facts() const { return facts_; }
  /// Whether poses are exact and not late.
  void set_exact(bool exact) { exact_ = exact; }

 private:
  bool IsSeen(const ObservableFact& fact, const IndexedVector<ObjectId, control::MovingPose>& objects,
              ObjectId held) const;
  /// The objects' poses by name, for regions; empty where no fact is about one.
  void TakePoses(const IndexedVector<ObjectId, control::MovingPose>& objects);

  const scene::Scene& scene_;
  FactObserverOptions options_;
  std::vector<ObservableFact> facts_;
  bool has_regions_ = false;
  std::map<std::string, math::Pose> X_WO_;
  double next_ = 0;
  bool started_ = false;
  bool exact_ = false;
};

}  // namespace tether::execution
