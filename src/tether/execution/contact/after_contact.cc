#include "tether/execution/contact/after_contact.h"

#include <algorithm>

#include "tether/geometry/distance/distance.h"
#include "tether/geometry/distance/query.h"

namespace tether::execution {
namespace {

// From this speed on, the hand moves along with what was touched, m/s.
constexpr double kTargetMoves = 0.005;
// What is further away than this is not touched any more, m.
constexpr double kClear = 0.01;

}  // namespace

ObjectId CarrierOf(const Situation& s, ObjectId object) {
  const int last = std::min(s.step, s.num_steps() - 1);
  for (int i = last; i >= 0; --i) {
    const ResolvedStep& step = s.steps[i];
    if (step.control == object && step.target.object != object) return step.target.object;
  }
  return s.stands_on[object];
}

bool IsCarriedBy(const Situation& s, ObjectId carrier, ObjectId object) {
  for (size_t hops = 0; hops < s.objects.size(); ++hops) {
    const ObjectId below = CarrierOf(s, object);
    if (below == carrier) return true;
    if (below == kNone || below == object) return false;
    object = below;
  }
  return false;
}

AfterContact::AfterContact(const Situation& situation, const Supports& supports)
    : s_(situation), supports_(supports), hand_(s_.model->HandShape(s_.model->gripper().max_opening)) {}

Contact AfterContact::Now() const {
  if (s_.recovering) return before_recovery_;
  Contact contact;
  contact.held = s_.held;
  if (!s_.in_plan()) return contact;
  if (s_.current().push) {
    contact.frame.object = s_.current().control;
  } else if (s_.held != kNone) {
    contact.frame.object = CarrierOf(s_, s_.held);
    // What it lay against counts where the plan does not say what it stood on.
    if (contact.frame.object == kNone && !supports_.list().empty())
      contact.frame.object = supports_.list().front();
  } else {
    contact.frame = s_.current().target;
    contact.released = s_.released != kNone ? s_.released : s_.current().control;
  }
  if (contact.frame.object == contact.held) contact.frame = {};
  return contact;
}

bool AfterContact::HandIsClearOf(ObjectId object) const {
  const geometry::Shape& shape = s_.object(object).shape;
  const math::Pose& X_WO = s_.X_WO(object);
  // Open fingers don't touch what is between them: the hand is clear of it once the finger tips are.
  return geometry::SignedDistance(hand_, s_.X_WH, shape, X_WO).distance >= kClear &&
         geometry::DistanceToPoint(shape, X_WO, s_.X_WH.p).distance >=
             s_.model->gripper().pad_half_height + kClear;
}

bool AfterContact::IsClearOf(const Contact& contact) const {
  const ObjectId object = contact.frame.object;
  if (object == kNone) return true;
  if (!HandIsClearOf(object)) return false;
  if (contact.released != kNone && !HandIsClearOf(contact.released)) return false;
  return contact.held == kNone ||
         geometry::SignedDistance(s_.object(contact.held).shape, s_.X_WO(contact.held),
                                  s_.object(object).shape, s_.X_WO(object))
                 .distance >= kClear;
}

std::optional<AttachedFrame> AfterContact::NextFrame(ObjectId present) {
  if (clear_) return std::nullopt;
  const Contact contact = Now();
  if (present == kNone && s_.V_WF(contact.frame).norm() <= kTargetMoves) return std::nullopt;
  clear_ = IsClearOf(contact);
  const AttachedFrame next = clear_ ? AttachedFrame{} : contact.frame;
  if (next.object == present) return std::nullopt;
  return next;
}

}  // namespace tether::execution
