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
ObjectId ReferenceServo::CarrierOf(ObjectId object) const {
  const int last = std::min(s_.step, s_.num_steps() - 1);
  for (int s = last; s >= 0; --s) {
    const ResolvedStep& step = s_.steps[s];
    if (step.control == object && step.target.object != object) return step.target.object;
  }
  std::string parent = s_.object(object).parent;
  for (size_t depth = 0; depth <= s_.scene.regions.size(); ++depth) {
    if (const ObjectId found = s_.scene.FindObjectId(parent); found.valid()) return found;
    const scene::Region* region = s_.scene.FindRegion(parent);
    if (region == nullptr) return kNone;
    parent = region->parent;
  }
  return kNone;
}

bool ReferenceServo::IsCarriedBy(ObjectId carrier, ObjectId object) const {
  for (size_t hops = 0; hops < s_.objects.size(); ++hops) {
    const ObjectId below = CarrierOf(object);
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
  if (!s_.in_plan()) return contact;
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
  const auto near = [&](const geometry::Shape& shape, const math::Pose& X_W, ObjectId object) {
    return geometry::SignedDistance(shape, X_W, s_.object(object).shape, X_WO(object)).distance < kClear;
  };
  // Open fingers don't touch what is between them: the hand is clear of it once the finger tips are.
  const auto at_hand = [&](ObjectId object) {
    return near(hand_shape_, s_.X_WH, object) ||
           geometry::DistanceToPoint(s_.object(object).shape, X_WO(object), s_.X_WH.p).distance <
               s_.model->gripper().pad_half_height + kClear;
  };
  if (at_hand(contact.frame.object)) return false;
  if (contact.released != kNone && at_hand(contact.released)) return false;
  return contact.held == kNone ||
         !near(s_.object(contact.held).shape, X_WO(contact.held), contact.frame.object);
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
