#pragma once

#include <optional>

#include "tether/common/id.h"
#include "tether/execution/contact/supports.h"
#include "tether/execution/servo/situation.h"
#include "tether/geometry/shape.h"

namespace tether::execution {

/// What was touched, and by what: verbs after a contact move along with it until they are clear of it.
struct Contact {
  AttachedFrame frame;  ///< In the world if nothing that can move was touched.
  ObjectId held;        ///< What the hand holds; kNone: the hand itself touches.
  ObjectId released;    ///< The object that the hand has released, on `frame`.
};

/// What the object was put on last, or stood on at the start; kNone: nothing that can move.
ObjectId CarrierOf(const Situation& situation, ObjectId object);

/// The object was put, or stood at the start, on the carrier, or on something that was.
bool IsCarriedBy(const Situation& situation, ObjectId carrier, ObjectId object);

/// A motion that begins in the world's frame goes on in that of what was touched as soon as that moves, and
/// in the world's again once the hand, and what it holds, are clear of it.
class AfterContact {
 public:
  /// `supports` says what the held object touches.
  AfterContact(const Situation& situation, const Supports& supports);

  /// What the present step touches, by the plan; in a recovery, what was touched as it began.
  Contact Now() const;
  /// A recovery may begin: what is touched at this moment counts for it.
  void Remember() { before_recovery_ = Now(); }
  const Contact& before_recovery() const { return before_recovery_; }

  /// A motion begins.
  void Start() { clear_ = false; }
  /// The frame in which a motion goes on that went along with `present` so far; nothing: in the same.
  std::optional<AttachedFrame> NextFrame(ObjectId present);

 private:
  bool IsClearOf(const Contact& contact) const;
  /// The open hand is clear of an object.
  bool HandIsClearOf(ObjectId object) const;

  const Situation& s_;
  const Supports& supports_;
  const geometry::Shape hand_;
  Contact before_recovery_;
  bool clear_ = false;
};

}  // namespace tether::execution
