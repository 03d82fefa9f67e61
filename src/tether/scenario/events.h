#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tether/common/document/value.h"
#include "tether/math/pose.h"
#include "tether/planning/skeleton/action.h"
#include "tether/robot/fault.h"
#include "tether/scene/scene.h"
#include "tether/symbolic/pddl/pddl.h"
#include "tether/task/goal/product.h"

namespace tether::scenario {

// What else can be done to a scene than moving an object or pushing an arm. The object is the event's.

/// An object is taken out of the scene.
struct Removal {};
/// A removed object is put back: at the event's goal, or where it was.
struct Return {};
/// An object is drawn away by the event's displacement, out of the hand if it is held; without a name that
/// which is held.
struct Pull {
  double force = 300;  ///< At most, N: more than a hand holds.
};
/// An object gets a blow.
struct Knock {
  Eigen::Vector3d impulse = Eigen::Vector3d::Zero();  ///< N s, in the world …
  Eigen::Vector3d at = Eigen::Vector3d::Zero();       ///< … m, a point in the object's frame.
};
/// An object is another in truth than the plan believes.
struct Alteration {
  std::optional<double> mass;      ///< kg
  std::optional<double> friction;  ///< Coulomb coefficient.
  std::optional<double> grow;      ///< Each of its lengths is greater by so much, m.
};
/// The goal is another from now on.
struct NewGoal {
  std::string pddl;                            ///< A PDDL formula, or …
  std::optional<task::TemporalGoal> temporal;  ///< … a temporal one.
};

/// A disturbance of a run: an object is moved at finite speed, an arm is pushed, or something else happens,
/// at a time, when an action starts or ends, when a step starts, or at a random moment of the run's seed.
struct Event {
  std::string starts;  ///< "pick(box)"; empty: another moment.
  std::string ends;    ///< The same, when it is done.
  int step = -1;       ///< When this step of the plan starts, from 0; −1: another moment.
  double after = 0;    ///< So long after its action or step, s.
  double time = 0;     ///< Otherwise at this time, s …
  double until = -1;   ///< … or, if above it, at a random one from `time` to this.
  std::string object;
  math::Pose X_by;  ///< Displacement in the world: p added, R applied on the left about the object's origin.
  bool has_goal = false;  ///< Moves to `X_ParentGoal` in `parent` instead of by a displacement.
  std::string parent;
  math::Pose X_ParentGoal;
  double over = 1;          ///< Duration, s.
  std::string robot;        ///< Instead of moving an object: this arm is pushed …
  Eigen::VectorXd torques;  ///< … with these joint torques, Nm.
  bool steady = false;      ///< At one speed, rather than rising and falling smoothly.
  /// In place of moving an object or pushing an arm.
  std::variant<std::monostate, Removal, Return, Pull, Knock, Alteration, NewGoal, robot::Fault> other;

  bool at_time() const { return starts.empty() && ends.empty() && step < 0; }

  /// "move box by (0, 0.1, 0) over 1 s", "push panda by (0, 10, 0, 0, 0, 0, 0) Nm over 0.3 s".
  std::string Describe() const;
};

/// What the names in events may be.
struct EventNames {
  const scene::Scene* scene = nullptr;
  const std::vector<planning::ActionSchema>* actions = nullptr;
  const symbolic::Problem* problem = nullptr;  ///< What a new goal is of.
};

/// Reads a list of events, or a document {format: tether.events/1, events: list}. Mistakes go to
/// `diagnostics`, also events that contradict each other.
std::vector<Event> ParseEvents(const Value& value, const EventNames& names, Diagnostics& diagnostics);

/// The same for a file. Throws InputError with all its mistakes.
std::vector<Event> ReadEvents(const std::string& path, const EventNames& names);

/// "pick(box)" split into {"pick", "box"}; empty if the text is no action.
std::vector<std::string> SplitAction(const std::string& text);

}  // namespace tether::scenario
