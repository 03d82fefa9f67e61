#pragma once

#include <vector>

#include "tether/common/id.h"
#include "tether/execution/servo/situation.h"

namespace tether::execution {

/// What the held object stood on, or lay against, as it was grasped, and still touches: this may go on until
/// the object is clear of it. Allocates nothing after construction.
class Supports {
 public:
  struct Distances {
    double touching = 0.004;  ///< What is grasped touches what it is nearer to than this, m …
    double clear = 0.01;      ///< … and is clear of it from this on, m.
  };

  Supports(const Situation& situation, const Distances& distances);

  /// What is held is another object now, or nothing: finds what that touches.
  void Find();
  /// Forgets what the held object is clear of; whether there was any.
  bool Watch();
  const std::vector<ObjectId>& list() const { return list_; }

 private:
  /// Of the held object from another, m.
  double DistanceTo(ObjectId object) const;

  const Situation& s_;
  Distances distances_;
  std::vector<ObjectId> list_;
};

}  // namespace tether::execution
