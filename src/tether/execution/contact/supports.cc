#include "tether/execution/contact/supports.h"

#include "tether/geometry/distance/distance.h"

namespace tether::execution {

Supports::Supports(const Situation& situation, const Distances& distances)
    : s_(situation), distances_(distances) {
  list_.reserve(s_.objects.size());
}

double Supports::DistanceTo(ObjectId object) const {
  return geometry::SignedDistance(s_.object(s_.held).shape, s_.X_WO(s_.held), s_.object(object).shape,
                                  s_.X_WO(object))
      .distance;
}

void Supports::Find() {
  list_.clear();
  if (s_.held == kNone) return;
  for (const ObjectId object : s_.objects.ids()) {
    if (object != s_.held && DistanceTo(object) < distances_.touching) list_.push_back(object);
  }
}

bool Supports::Watch() {
  return std::erase_if(list_, [this](ObjectId object) { return DistanceTo(object) >= distances_.clear; }) > 0;
}

}  // namespace tether::execution
