#include "tether/evaluation/loop/disturber.h"

#include <algorithm>
#include <utility>

#include "tether/common/random.h"
#include "tether/common/text.h"

namespace tether::evaluation {
namespace {

template <typename T>
bool Holds(const std::vector<T>& list, const T& value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

}  // namespace

Disturber::Disturber(const scene::Scene& scene, std::vector<scenario::Event> events, uint64_t seed,
                     sim::World& world)
    : scene_(scene), world_(world) {
  const Random random = Random(seed).Split("events");
  for (scenario::Event& event : events) {
    Entry entry;
    entry.event = std::move(event);
    if (entry.event.at_time()) entry.due = entry.event.time;
    if (entry.event.until > entry.event.time) {
      // Of its own number, so that one more event changes no other.
      Random own = random.Split(std::to_string(entries_.size()));
      entry.due = own.Uniform(entry.event.time, entry.event.until);
    }
    entries_.push_back(std::move(entry));
  }
}

std::vector<const scenario::Event*> Disturber::Disturb(const Moment& moment,
                                                       const scene::WorldEstimate& truth,
                                                       const std::string& held) {
  std::vector<const scenario::Event*> begun;
  for (Entry& entry : entries_) {
    const scenario::Event& event = entry.event;
    if (entry.done) continue;
    if (entry.due < 0 && (Holds(moment.started, event.starts) || Holds(moment.ended, event.ends) ||
                          Holds(moment.steps, event.step)))
      entry.due = world_.time() + event.after;
    if (entry.due < 0 || world_.time() < entry.due) continue;
    const auto* pull = std::get_if<scenario::Pull>(&event.other);
    // A hand that holds nothing yet is waited for.
    if (pull != nullptr && event.object.empty() && held.empty()) continue;
    entry.done = true;
    Begin(event, truth, held);
    begun.push_back(&event);
  }
  return begun;
}

void Disturber::Begin(const scenario::Event& event, const scene::WorldEstimate& truth,
                      const std::string& held) {
  struct Apply {
    Disturber& self;
    const scenario::Event& event;
    const scene::WorldEstimate& truth;
    const std::string& held;

    void operator()(std::monostate) const {
      if (!event.robot.empty()) return self.world_.PushArm(event.robot, event.torques, event.over);
      self.world_.MoveObject(event.object, self.Goal(event, truth), event.over, event.steady);
    }
    void operator()(const scenario::Removal&) const {
      if (Holds(self.removed_, event.object)) return;
      self.before_[event.object] = truth.X_WO.at(event.object);
      self.world_.RemoveObject(event.object);
      self.removed_.push_back(event.object);
    }
    void operator()(const scenario::Return&) const {
      if (!Holds(self.removed_, event.object)) return;
      self.world_.ReturnObject(event.object,
                               event.has_goal ? self.Goal(event, truth) : self.before_.at(event.object));
      std::erase(self.removed_, event.object);
    }
    void operator()(const scenario::Pull& pull) const {
      self.world_.PullObject(event.object.empty() ? held : event.object, event.X_by.p, event.over,
                             pull.force);
    }
    void operator()(const scenario::Knock& knock) const {
      self.world_.KnockObject(event.object, knock.impulse, knock.at);
    }
    void operator()(const scenario::Alteration& set) const {
      self.world_.ChangeObject(event.object, {set.mass, set.friction, set.grow});
    }
    // These are the caller's.
    void operator()(const scenario::NewGoal&) const {}
    void operator()(const robot::Fault&) const {}
  };
  std::visit(Apply{*this, event, truth, held}, event.other);
}

math::Pose Disturber::Goal(const scenario::Event& event, const scene::WorldEstimate& truth) const {
  if (!event.has_goal) {
    const math::Pose& X = truth.X_WO.at(event.object);
    return {event.X_by.R * X.R, event.X_by.p + X.p};
  }
  const auto parent = truth.X_WO.find(event.parent);
  return (parent != truth.X_WO.end() ? parent->second : scene_.InitialPose(event.parent)) *
         event.X_ParentGoal;
}

std::vector<std::string> Disturber::Missed() const {
  std::vector<std::string> missed;
  for (const Entry& entry : entries_) {
    if (entry.done) continue;
    const scenario::Event& event = entry.event;
    std::string why;
    if (entry.due >= 0) {
      why = world_.time() < entry.due ? "the run ended before " + Fixed(entry.due, 2) + " s"
                                      : "nothing was held from then on";
    } else if (event.step >= 0) {
      why = "step " + std::to_string(event.step) + " never started";
    } else if (!event.ends.empty()) {
      why = "'" + event.ends + "' never ended";
    } else {
      why = "'" + event.starts + "' never started";
    }
    missed.push_back(event.Describe() + ": " + why);
  }
  return missed;
}

}  // namespace tether::evaluation
