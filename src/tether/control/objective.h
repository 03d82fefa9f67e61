#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tether/constraints/core/pose_function.h"
#include "tether/math/pose.h"

namespace tether::control {

/// What a frame F on the hand, or on what it holds, is to do relative to a frame T. Paper B, section 2.2: the
/// fewer degrees of freedom an objective uses, the more are left for constraints.
enum class Objective {
  kPose,         ///< 6: F at its pose in T.
  kOrientation,  ///< 3: F's axes as in its pose.
  kPosition,     ///< 3: F's origin at its place.
  kLine,         ///< 4: F's z axis on the line that it is on in its pose.
  kPlane,        ///< 3: F's xy plane in the plane that it is in in its pose.
  kDistance,     ///< 1: F's origin in the plane through its place that is parallel to T's xy plane.
};

/// "pose", "orientation", …
std::vector<std::string> ObjectiveNames();
std::optional<Objective> FindObjective(const std::string& name);
std::string ToString(Objective objective);

/// The functions of frames (T, F), m and rad, that are zero where the objective is reached with F at X_TF.
/// Lines and planes have a second root with F upside down: the nearer one is reached.
std::vector<constraints::PoseFunctionPtr> MakeObjective(Objective objective, const math::Pose& X_TF);

}  // namespace tether::control
