#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tether/common/document/value.h"
#include "tether/math/pose.h"
#include "tether/planning/skeleton/action.h"
#include "tether/robot/fault.h"
#include "tether/scene/scene.h"

namespace tether::scenario {

/// A disturbance of a run: an object is moved at finite speed, an arm is pushed, or something is not measured
/// or does not answer, when an action starts or at a time.
struct Event {
  std::string starts;  ///< "pick(box)", or empty: at `time`.
  double time = 0;     ///< s
  std::string object;
  math::Pose X_by;  ///< Displacement in the world: p added, R applied on the left about the object's origin.
  bool has_goal = false;  ///< Moves to `X_ParentGoal` in `parent` instead of by a displacement.
  std::string parent;
  math::Pose X_ParentGoal;
  double over = 1;                    ///< Duration, s.
  std::string robot;                  ///< Instead of moving an object: this arm is pushed …
  Eigen::VectorXd torques;            ///< … with these joint torques, Nm.
  bool steady = false;                ///< At one speed, rather than rising and falling smoothly.
  std::optional<robot::Fault> fault;  ///< In place of both.

  /// "move box by (0, 0.1, 0) over 1 s", "push panda by (0, 10, 0, 0, 0, 0, 0) Nm over 0.3 s",
  /// "fault of panda: silence for 0.1 s".
  std::string Describe() const;
};

/// What the names in events may be.
struct EventNames {
  const scene::Scene* scene = nullptr;
  const std::vector<planning::ActionSchema>* actions = nullptr;
};

/// Reads a list of events, or a document {format: tether.events/1, events: list}. Mistakes go to
/// `diagnostics`.
std::vector<Event> ParseEvents(const Value& value, const EventNames& names, Diagnostics& diagnostics);

/// The same for a file. Throws InputError with all its mistakes.
std::vector<Event> ReadEvents(const std::string& path, const EventNames& names);

/// "pick(box)" split into {"pick", "box"}; empty if the text is no action.
std::vector<std::string> SplitAction(const std::string& text);

}  // namespace tether::scenario
