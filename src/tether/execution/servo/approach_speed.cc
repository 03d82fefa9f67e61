#include <algorithm>
#include <cmath>
#include <variant>

#include "tether/execution/servo/reference_servo.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/distance/distance.h"

namespace tether::execution {
namespace {

// The action's speed holds while hand, or what it holds, is this near to anything else, m.
constexpr double kNear = 0.02;
// Further away than this, m, is far; looked at every so many ticks.
constexpr double kLook = 0.2;
constexpr int kTicks = 8;
// The reference settles at this rate, 1/s: without a push or a turn about a corner it can.
constexpr double kSettleRate = 20;

}  // namespace

double ReferenceServo::FindRoom() const {
  double room = kLook;
  const auto measure = [&](const geometry::Shape& shape, const math::Pose& X_WS) {
    const geometry::Aabb box = geometry::BoundingBox(shape, X_WS);
    for (const ObjectId i : s_.objects.ids()) {
      if (MovesWithHand(i)) continue;
      const geometry::Shape& other = s_.object(i).shape;
      if (box.DistanceTo(geometry::BoundingBox(other, s_.objects[i].X)) >= room) continue;
      room = std::min(room, geometry::SignedDistance(shape, X_WS, other, s_.objects[i].X).distance);
    }
  };
  measure(hand_shape_, s_.X_WH);
  if (s_.held != kNone) measure(s_.object(s_.held).shape, X_WO(s_.held));
  return room;
}

// Approach, lift and retreat: the action's speed holds near the first possible contact and the last one;
// beyond, the hand moves as fast as it can still brake.
void ReferenceServo::LimitMotion(MotionLimits* limits) {
  const double asked = std::min(limits->speed, now_.speed > 0 ? now_.speed : limits->speed);
  limits->speed = asked;
  if (!s_.in_plan() || s_.recovering || now_.transit) return;
  const planning::Verb& verb = s_.verbs()[s_.verb];
  const bool shifts = std::holds_alternative<planning::ShiftVerb>(verb);
  const bool approaches = std::holds_alternative<planning::ReachVerb>(verb) &&
                          s_.verb > s_.current().first_reach && !s_.current().push;
  if (!shifts && !approaches) return;
  if (tick_ % kTicks == 0 || room_ < 0) room_ = FindRoom();
  const double beyond = std::max(0.0, room_ - kNear);
  limits->acceleration = std::max(limits->acceleration, options_.free_acceleration);
  limits->settle_rate = kSettleRate;
  limits->speed = std::clamp(std::sqrt(asked * asked + limits->acceleration * beyond), asked,
                             std::max(asked, options_.free_speed));
}

}  // namespace tether::execution
