#pragma once

#include <vector>

#include <Eigen/Core>

#include "tether/motion/collision_scene.h"

namespace tether::motion {

/// What an arm overlaps by more than a millimetre in a configuration (n, rad): the deepest touch of links,
/// hand and what is held, with obstacles and with the arm itself; and each obstacle that the base is inside
/// of by more than 5 mm, as none of the arm's motions changes that. Empty: it stands free.
std::vector<Touch> FindOverlaps(const Snapshot& snapshot, const Eigen::VectorXd& q);

/// The solids of an arm that stands still, in the base frame of another one: obstacles named "NAME's link".
/// `X_BOther`: its base in that frame.
void AddArm(const std::string& name, const robot::Model& model, const Eigen::VectorXd& q,
            const math::Pose& X_BOther, std::vector<Obstacle>* obstacles);

}  // namespace tether::motion
