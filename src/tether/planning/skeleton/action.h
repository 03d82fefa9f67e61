#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "tether/common/document/value.h"

namespace tether::planning {

/// The frame in which a verb's displacement is given.
enum class In { kControl, kTarget, kHand, kWorld };

/// Servo the control frame to its key pose relative to the target, plus an offset.
struct ReachVerb {
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< m, in the frame `in`
  In in = In::kControl;
  double speed = 0.25;               ///< Greatest linear speed, m/s
  double position_tolerance = 0.01;  ///< m
  double rotation_tolerance = 0.05;  ///< rad
  bool until_contact = false;        ///< Ends at contact too.
  double above = 0;       ///< With a region: the height above its plane and above what stands there, m.
  std::string objective;  ///< Empty: the full pose. Else a registered objective.
  Value constraints;      ///< Extra control constraints, as written.
};

/// Move the hand relative to where it is when the verb starts.
struct ShiftVerb {
  Eigen::Vector3d by = Eigen::Vector3d::Zero();  ///< m, in the frame `in`
  In in = In::kWorld;
  double speed = 0.15;  ///< m/s
};

/// Open the gripper, or close it on an object.
struct GripperVerb {
  std::string close_on;  ///< Name of an object (or action parameter); empty: open.
  double force = 20;     ///< N at each pad
};

struct WaitVerb {
  double seconds = 0;
  std::string region = {};  ///< As long as this region's `dwell`; empty: `seconds`.
};

using Verb = std::variant<ReachVerb, ShiftVerb, GripperVerb, WaitVerb>;

/// A constraint as written in a file: its registered kind and its parameters, unresolved.
struct ConstraintSpec {
  std::string kind;
  Value parameters;
  Location where;
};

/// One key pose of an action: which frame is controlled relative to which, what must hold, how it is
/// executed. Names are the action's parameters, "hand", or names of the scene.
struct StepSchema {
  std::string control;
  std::string target;
  bool target_is_region = false;  ///< No key pose: any pose in the region serves.
  std::vector<ConstraintSpec> constraints;
  std::vector<std::pair<std::string, std::string>> allow;  ///< Pairs that may touch.
  std::vector<Verb> execute;
  Location where;
  std::optional<double> max_force =
      {};  ///< That the arm may press with in this step, N; else the scenario's.
};

/// The geometric side of a PDDL action, bound to it by name; parameters are bound by position.
struct ActionSchema {
  std::string name;
  std::vector<std::string> parameters;
  std::vector<StepSchema> steps;
  Location where;
};

}  // namespace tether::planning
