#pragma once

#include "tether/motion/collision_scene.h"
#include "tether/motion/kernel/sphere_kernel.h"

namespace tether::motion::internal {

/// The scene in single precision, with margins for what that rounds.
KernelTables MakeKernelTables(const CollisionScene& scene);

}  // namespace tether::motion::internal
