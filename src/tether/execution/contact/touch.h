#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "tether/common/id.h"
#include "tether/control/arm_bodies.h"

namespace tether::execution {

/// Two that may touch: kTouchingHand, which stands for all that moves with the hand, or an object of the
/// scene. The lesser id, and so the hand, comes first.
using Touch = std::pair<ObjectId, ObjectId>;
inline constexpr ObjectId kTouchingHand{};

/// Pairs that the present step may bring into contact, each once. Allocates nothing within what is reserved.
class TouchList {
 public:
  void reserve(size_t size) { pairs_.reserve(size); }
  void clear() { pairs_.clear(); }
  /// In either order; nothing touches itself.
  void Allow(ObjectId a, ObjectId b);
  /// Whether they may touch, in either order.
  bool Allows(ObjectId a, ObjectId b) const;
  const std::vector<Touch>& pairs() const { return pairs_; }

  bool operator==(const TouchList&) const = default;

 private:
  std::vector<Touch> pairs_;
};

/// The same pairs by a controller's numbers of bodies, as its Allow() takes them. `pairs` is filled anew.
void FindBodies(const TouchList& touches, const control::ArmBodies& bodies,
                std::vector<std::pair<int, int>>* pairs);

}  // namespace tether::execution
