#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tether/control/constraint_spec.h"
#include "tether/ltl/formula/formula.h"
#include "tether/nlp/solver.h"
#include "tether/planning/plan/problem.h"
#include "tether/robot/model.h"
#include "tether/robot/sensing.h"
#include "tether/scenario/events.h"
#include "tether/scene/scene.h"
#include "tether/symbolic/pddl/pddl.h"
#include "tether/task/goal/product.h"

namespace tether::scenario {

/// The `format` of a scenario.
inline constexpr const char* kScenarioFormat = "tether.scenario/1";

/// The default of the longest plan that is considered.
inline constexpr int kMaxActions = 20;

/// The most threads of planning.
inline constexpr int kMostThreads = 1024;

/// Control rates that are accepted, Hz.
inline constexpr double kSlowestRate = 10, kFastestRate = 1e5;

/// The task, as written. The PDDL problem, when there is one, stands in Scenario::problem, the temporal goal
/// in Scenario::goal.
struct Task {
  std::string domain;   ///< Path of the PDDL domain; empty: that of the scene's regions, if any.
  std::string problem;  ///< Path of the PDDL problem; empty: none.
  std::string ltl;      ///< A temporal goal; empty: none.
  ltl::Semantics semantics = ltl::Semantics::kCosafe;  ///< Of the temporal goal.
  /// Predicates of one parameter that hold at the start for exactly what the arm reaches.
  std::vector<std::string> within_reach;
  /// None: kMaxActions, or no limit where plans have no poses to be optimised.
  std::optional<int> max_actions;
  Location where;
};

/// A constraint that holds at every step.
struct GlobalConstraint {
  planning::ConstraintSpec spec;
  std::optional<int> relax;  ///< May be relaxed, highest first; absent: never.
};

struct PlanningSettings {
  nlp::Backend solver = nlp::Backend::kNative;
  planning::Weights weights;
  planning::Objective objective = planning::Objective::kSquares;
  bool home = true;   ///< First and last key pose are the hand's start.
  bool robot = true;  ///< Reach and grasp of the robot constrain the plan.
  /// The number of best plans wanted; 0: all. None: the best, with the candidates met until it was found.
  std::optional<int> max_plans;
  int min_candidates = planning::SearchOptions().min_candidates;
  double patience = planning::SearchOptions().patience;
  int threads = 0;          ///< 0: as many as there are processors.
  double time_limit_s = 0;  ///< Wall clock; 0: no limit.
  double latency = 0.02;    ///< While it runs, a new plan is adopted so long after it was asked for, s.
  /// Of one solve, in the solver's own unit; none: what the solver needs (planning::EffortOf).
  std::optional<int> max_iterations;
};

/// What moves the arm.
enum class Controller {
  kConstrainedTorque,
  kOperationalSpace,  ///< Torques without constraints.
  kConstrainedVelocity,
};
/// "constrained_torque", "operational_space" or "constrained_velocity", as in files.
std::string ToString(Controller controller);

struct ExecutionSettings {
  Controller controller = Controller::kConstrainedTorque;
  double rate = 1000;  ///< Control rate, Hz.
  std::optional<double>
      gain;  ///< Of torques: k_p, 1/s²; constrained_velocity: η, 1/s. None: the controller's own.
  std::optional<double>
      damping;               ///< Of torques: k_v, 1/s; constrained_velocity: λ. None: the controller's own.
  double max_force = 40;     ///< That the arm presses with, N: constrained_torque.
  Location max_force_where;  ///< Where the file says so.
  double timeout_s = 300;    ///< Simulated time after which a run has failed, s.
};

/// Bounds on the displacement of a run's initial poses from the file's, per movable object. Drawn from the
/// run's seed.
struct Perturbation {
  double position = 0;  ///< Radius of the horizontal disc, m.
  double rotation = 0;  ///< Greatest yaw, rad.
};

/// A scenario file, read and checked.
struct Scenario {
  std::string path;
  std::string title;
  uint64_t seed = 0;
  scene::Scene scene;
  std::map<std::string, std::shared_ptr<const robot::Model>> models;  ///< By robot name.
  Task task;
  /// With the goal that counts, unless that is temporal; null without a domain.
  std::shared_ptr<const symbolic::Problem> problem;
  std::optional<task::TemporalGoal> goal;  ///< In place of the problem's goal.
  std::vector<planning::ActionSchema> actions;
  std::vector<GlobalConstraint> constraints;                 ///< Of key poses.
  std::vector<control::ConstraintSpec> control_constraints;  ///< Of the velocity controller.
  PlanningSettings planning;
  ExecutionSettings execution;
  robot::Sensing sensing;  ///< What sensors lack in a run.
  std::vector<Event> events;
  Perturbation perturb;
};

/// Reads a scenario in format `tether.scenario/1`, with the PDDL files, action libraries and event file that
/// it names. Throws InputError with all their mistakes: malformed text, unknown keys and names with the
/// nearest match, sizes and numbers out of range, cycles among parents, PDDL objects without a body, PDDL
/// actions without geometry.
Scenario LoadScenario(const std::string& path);

/// The same for a scenario that need not be on disk: the scenario and the PDDL files that are among `files`,
/// texts by path, are read from there.
Scenario LoadScenario(const std::string& path, const std::map<std::string, std::string>& files);

/// Names of the shipped action libraries.
std::vector<std::string> ShippedActionLibraries();

}  // namespace tether::scenario
