#include "tether/execution/contact/touch.h"

#include <algorithm>

namespace tether::execution {
void TouchList::Allow(ObjectId a, ObjectId b) {
  if (a == b) return;
  const Touch touch(std::min(a, b), std::max(a, b));
  if (std::find(pairs_.begin(), pairs_.end(), touch) == pairs_.end()) pairs_.push_back(touch);
}

bool TouchList::Allows(ObjectId a, ObjectId b) const {
  return std::find(pairs_.begin(), pairs_.end(), Touch(std::min(a, b), std::max(a, b))) != pairs_.end();
}

void FindBodies(const TouchList& touches, const control::ArmBodies& bodies,
                std::vector<std::pair<int, int>>* pairs) {
  pairs->clear();
  for (const auto& [first, second] : touches.pairs()) {
    const int other = bodies.object(second.value());
    if (first != kTouchingHand) {
      pairs->emplace_back(bodies.object(first.value()), other);
      continue;
    }
    for (int body = 0; body <= bodies.hand(); ++body) {
      if (bodies.link(body) == bodies.link(bodies.hand())) pairs->emplace_back(body, other);
    }
  }
}

}  // namespace tether::execution
