#pragma once

#include <optional>
#include <string>

#include "tether/constraints/grasps/part_grasps.h"
#include "tether/geometry/shape.h"
#include "tether/math/pose.h"
#include "tether/robot/model.h"

namespace tether::constraints {

/// A grasp from straight above, for plans that leave the grasp open: the hand's z axis points down in the
/// world, the fingers close where the object is narrowest, and of the two equivalent orientations the hand
/// has the one nearer to its present one.
struct TopGrasp {
  math::Pose X_OH;   ///< Of the hand in the object's frame.
  double width = 0;  ///< Between the fingers, m.
};

/// None if there is none (GraspsOfPart); `flaws`, if given, then says why. The hand goes as deep as the palm
/// allows with `palm_clearance` (m), but the fingers stay `foot_clearance` above the object's foot.
std::optional<TopGrasp> FindTopGrasp(const robot::Model& model, const geometry::Shape& shape,
                                     const math::Pose& X_WO, const Eigen::Matrix3d& R_WH,
                                     const Load& load = {}, GraspFlaws* flaws = nullptr,
                                     double palm_clearance = 0.015, double foot_clearance = 0.015);

}  // namespace tether::constraints
