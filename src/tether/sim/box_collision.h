#pragma once

namespace tether::sim {

/// Guards MuJoCo's box–box collision, for the whole process. MuJoCo 2.2.2 reports contacts more than a metre
/// deep, now and then, for boxes whose edges are nearly parallel: where boxes that lie flat come to rest.
/// Every result is compared with the exact overlap of the two boxes; an impossible one is computed again with
/// the boxes turned apart by 1e-9 rad and more. Repeated calls do nothing.
void GuardBoxCollision();

}  // namespace tether::sim
