#pragma once

#include <vector>

#include "tether/common/id.h"
#include "tether/execution/servo/situation.h"
#include "tether/scene/scene.h"

namespace tether::execution {

/// What carries a region is what lies beneath its plane within its outline, whatever its frame is attached
/// to, and the object that its frame is attached to; what is held does not. `region` is an index in
/// Scene::regions. `found` is filled anew.
void FindCarriers(const Situation& situation, int region, std::vector<ObjectId>* found);

/// Adds what lies beneath a carrier while the held object is above that, within its outline: the object can't
/// keep its distance from it then, for a mat is thinner than clearances. Each once.
void AddBeneath(const Situation& situation, ObjectId carrier, std::vector<ObjectId>* found);

}  // namespace tether::execution
