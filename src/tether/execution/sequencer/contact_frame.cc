#include <algorithm>

#include "tether/execution/sequencer/executive_impl.h"
#include "tether/geometry/distance/distance.h"
#include "tether/geometry/distance/query.h"

namespace tether::execution {
namespace {

// From this speed on, the hand moves along with what was touched, m/s.
constexpr double kTargetMoves = 0.005;
// What is further away than this is not touched any more, m.
constexpr double kClear = 0.01;

}  // namespace

// What the object was put on last, or stood on at the start.
int Executive::Impl::CarrierOf(int object) const {
  const int last = std::min(step_, static_cast<int>(resolved_.steps.size()) - 1);
  for (int s = last; s >= 0; --s) {
    const ResolvedStep& step = resolved_.steps[static_cast<size_t>(s)];
    if (step.control == object && step.target.object != object) return step.target.object;
  }
  std::string parent = scene_.objects[static_cast<size_t>(object)].parent;
  for (size_t depth = 0; depth <= scene_.regions.size(); ++depth) {
    for (size_t i = 0; i < scene_.objects.size(); ++i) {
      if (scene_.objects[i].name == parent) return static_cast<int>(i);
    }
    const scene::Region* region = scene_.FindRegion(parent);
    if (region == nullptr) return kNone;
    parent = region->parent;
  }
  return kNone;
}

Contact Executive::Impl::TouchedNow() const {
  if (recovering_) return before_recovery_;
  Contact contact;
  contact.held = held_;
  if (step_ >= static_cast<int>(resolved_.steps.size())) return contact;
  if (step().push) {
    contact.frame.object = step().control;
  } else if (held_ != kNone) {
    contact.frame.object = CarrierOf(held_);
  } else {
    contact.frame = step().target;
    contact.released = step().control;
  }
  if (contact.frame.object == contact.held) contact.frame = {};
  return contact;
}

bool Executive::Impl::IsClearOf(const Contact& contact) const {
  if (contact.frame.object == kNone) return true;
  const auto near = [&](const geometry::Shape& shape, const math::Pose& X_W, int object) {
    return geometry::SignedDistance(shape, X_W, scene_.objects[static_cast<size_t>(object)].shape,
                                    X_WO(object))
               .distance < kClear;
  };
  // Open fingers don't touch what is between them: the hand is clear of it once the finger tips are.
  const auto at_hand = [&](int object) {
    return near(hand_shape_, X_WH_, object) ||
           geometry::DistanceToPoint(scene_.objects[static_cast<size_t>(object)].shape, X_WO(object), X_WH_.p)
                   .distance < model_->gripper().pad_half_height + kClear;
  };
  if (at_hand(contact.frame.object)) return false;
  if (contact.released != kNone && at_hand(contact.released)) return false;
  return contact.held == kNone || !near(scene_.objects[static_cast<size_t>(contact.held)].shape,
                                        X_WO(contact.held), contact.frame.object);
}

// A verb that begins in the world's frame continues in that of what was touched as soon as that moves, and in
// the world's again once it is clear. Its goal does not jump at the change.
void Executive::Impl::GoAlong() {
  if (now_.clear) return;
  const Contact contact = TouchedNow();
  now_.clear = IsClearOf(contact);
  const bool moves = frame_.object != kNone || V_WF(contact.frame).norm() > kTargetMoves;
  if (!moves) return;
  const AttachedFrame& next = now_.clear ? AttachedFrame{} : contact.frame;
  if (next.object == frame_.object) return;
  const math::Pose X_WG = X_WF(frame_) * now_.X_TG;
  SwitchFrame(next);
  now_.X_TG = math::Between(X_WF(frame_), X_WG);
}

}  // namespace tether::execution
