#include <algorithm>

#include "tether/execution/servo/reference_servo.h"
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
int ReferenceServo::CarrierOf(int object) const {
  const int last = std::min(s_.step, static_cast<int>(s_.steps.size()) - 1);
  for (int s = last; s >= 0; --s) {
    const ResolvedStep& step = s_.steps[static_cast<size_t>(s)];
    if (step.control == object && step.target.object != object) return step.target.object;
  }
  std::string parent = s_.scene.objects[static_cast<size_t>(object)].parent;
  for (size_t depth = 0; depth <= s_.scene.regions.size(); ++depth) {
    for (size_t i = 0; i < s_.scene.objects.size(); ++i) {
      if (s_.scene.objects[i].name == parent) return static_cast<int>(i);
    }
    const scene::Region* region = s_.scene.FindRegion(parent);
    if (region == nullptr) return kNone;
    parent = region->parent;
  }
  return kNone;
}

bool ReferenceServo::IsCarriedBy(int carrier, int object) const {
  for (size_t hops = 0; hops < s_.objects.size(); ++hops) {
    const int below = CarrierOf(object);
    if (below == carrier) return true;
    if (below == kNone || below == object) return false;
    object = below;
  }
  return false;
}

Contact ReferenceServo::TouchedNow() const {
  if (s_.recovering) return before_recovery_;
  Contact contact;
  contact.held = s_.held;
  if (s_.step >= static_cast<int>(s_.steps.size())) return contact;
  if (s_.current().push) {
    contact.frame.object = s_.current().control;
  } else if (s_.held != kNone) {
    contact.frame.object = CarrierOf(s_.held);
  } else {
    contact.frame = s_.current().target;
    contact.released = s_.current().control;
  }
  if (contact.frame.object == contact.held) contact.frame = {};
  return contact;
}

bool ReferenceServo::IsClearOf(const Contact& contact) const {
  if (contact.frame.object == kNone) return true;
  const auto near = [&](const geometry::Shape& shape, const math::Pose& X_W, int object) {
    return geometry::SignedDistance(shape, X_W, s_.scene.objects[static_cast<size_t>(object)].shape,
                                    X_WO(object))
               .distance < kClear;
  };
  // Open fingers don't touch what is between them: the hand is clear of it once the finger tips are.
  const auto at_hand = [&](int object) {
    return near(hand_shape_, s_.X_WH, object) ||
           geometry::DistanceToPoint(s_.scene.objects[static_cast<size_t>(object)].shape, X_WO(object),
                                     s_.X_WH.p)
                   .distance < s_.model->gripper().pad_half_height + kClear;
  };
  if (at_hand(contact.frame.object)) return false;
  if (contact.released != kNone && at_hand(contact.released)) return false;
  return contact.held == kNone || !near(s_.scene.objects[static_cast<size_t>(contact.held)].shape,
                                        X_WO(contact.held), contact.frame.object);
}

// A verb that begins in the world's frame continues in that of what was touched as soon as that moves, and in
// the world's again once it is clear. Its goal does not jump at the change.
void ReferenceServo::GoAlong() {
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
