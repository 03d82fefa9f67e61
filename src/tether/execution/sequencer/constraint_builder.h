#pragma once

#include <map>
#include <string>
#include <vector>

#include "tether/control/constrained_velocity.h"
#include "tether/control/constraint_spec.h"
#include "tether/execution/sequencer/resolved_plan.h"
#include "tether/scene/scene.h"

namespace tether::execution {

/// The scene as the velocity controller sees it: objects by number, frames attached to them.
class ControlScene {
 public:
  /// `robot` is the acting one's name.
  ControlScene(const scene::Scene& scene, const std::string& robot);

  const std::vector<control::Solid>& solids() const { return solids_; }
  const math::Pose& X_WBase() const { return X_WBase_; }
  /// Not valid for other names.
  ObjectId Find(const std::string& name) const;
  /// A frame by name, as a target: what is attached to an object moves with it. "r/base" is a robot's base.
  control::Frame Target(const std::string& name) const;
  /// The same for a frame that was looked up.
  control::Frame Target(const AttachedFrame& frame) const;
  /// The object that a frame is attached to, or itself; empty for what is attached to the world.
  std::string SupportOf(const std::string& name) const;

 private:
  const scene::Scene& scene_;
  std::vector<control::Solid> solids_;
  std::map<std::string, ObjectId> index_;
  math::Pose X_WBase_;
};

/// A scenario's constraints, ready for the controller.
struct BuiltConstraints {
  std::vector<control::ClearanceConstraint> clearances;
  std::vector<control::FieldConstraint> fields;
  double joint_margin = 0;  ///< rad
};

/// `bodies` numbers the arm's bodies. Names must have been checked.
BuiltConstraints BuildConstraints(const std::vector<control::ConstraintSpec>& specs,
                                  const ControlScene& scene, const control::ArmBodies& bodies);

/// One field: `outside` or `tilt`.
control::FieldConstraint BuildField(const control::ConstraintSpec& spec, const ControlScene& scene);

/// A reach that brings a frame F onto the plane of a flat region, whose frame is T.
struct RegionReach {
  control::Frame target, frame;
  Eigen::Vector3d p_TF;   ///< F's origin as the reach begins, m.
  Eigen::Vector3d up_F;   ///< Unit: the direction of F that shall point along the region's z axis.
  double radius = 0;      ///< Of the footprint of what is brought to the region, m.
  double end_height = 0;  ///< A cone ends at this height over the region, where the reach does, m.
};

/// The reach's own field: `cone` (paper B, eqs. (3)–(11)) or `upright`. `buffer` is the controller's, m.
control::FieldConstraint BuildRegionField(const control::ConstraintSpec& spec, const scene::Region& region,
                                          const RegionReach& reach, double buffer);

}  // namespace tether::execution
