#pragma once

#include "tether/motion/collision_scene.h"

namespace tether::motion {

/// The least distance (m) of the arm, its hand and what it holds from each other and from obstacles, by a
/// plain loop over geometry's distances of whole solids: the oracle of PathChecker. Shares nothing with it.
double SlowDistance(const Snapshot& snapshot, const Eigen::VectorXd& q);

}  // namespace tether::motion
