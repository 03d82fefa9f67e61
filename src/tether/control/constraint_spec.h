#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tether/common/document/value.h"
#include "tether/common/error.h"

namespace tether::control {

/// A constraint of the velocity controller as read from a file, with its names checked but not yet looked up.
/// Which fields count depends on `kind`.
struct ConstraintSpec {
  std::string kind;  ///< One of ConstraintSpecKinds().
  Location where;
  std::optional<int> relax;                         ///< May be relaxed, highest first; absent: never.
  std::vector<std::string> of, to;                  ///< clearance
  double distance = 0;                              ///< clearance, m
  std::string frame;                                ///< outside, tilt: "hand", "held" or an object
  double cylinder = 0;                              ///< outside: radius, m
  std::string around;                               ///< outside: the frame whose z axis it is about
  double margin = 0;                                ///< joint_limits: rad; cone: m
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< tilt: unit, in `frame`
  Eigen::Vector3d from = Eigen::Vector3d::UnitZ();  ///< tilt: unit, in the world
  double max = 0;                                   ///< tilt, upright: rad
  double per_height = 0;                            ///< upright: rad/m
};

/// What the names in a constraint may be.
struct ConstraintNames {
  std::vector<std::string> objects;  ///< All objects of the scene.
  std::vector<std::string> movable;  ///< Those that can be held.
  std::vector<std::string> frames;   ///< All frames; of a robot `r` also "r/base".
};

/// Where a constraint is written: in a scenario, or with a verb that goes to a region.
enum class ConstraintPlace { kScenario, kRegionVerb };

/// clearance, joint_limits, outside and tilt; with a verb also cone and upright.
std::vector<std::string> ConstraintSpecKinds(ConstraintPlace place);

/// Reads a list of `- kind: {parameters}`. Adds to `diagnostics` unknown kinds, keys and names, with the
/// nearest match, and numbers out of bounds.
std::vector<ConstraintSpec> ReadConstraintSpecs(const Value& list, ConstraintPlace place,
                                                const ConstraintNames& names, Diagnostics& diagnostics);

/// "clearance of links and held to table and objects": for reports.
std::string Describe(const ConstraintSpec& spec);

}  // namespace tether::control
