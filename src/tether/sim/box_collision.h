#pragma once

namespace tether::sim {

/// Guards MuJoCo's box–box collision, for the whole process. MuJoCo 2.2.2 reports contacts more than a metre
/// deep, now and then, for boxes with edges that are parallel up to 1e-15 to 1e-13 rad: where boxes that lie
/// flat come to rest. Repeated calls do nothing.
void GuardBoxCollision();

}  // namespace tether::sim
