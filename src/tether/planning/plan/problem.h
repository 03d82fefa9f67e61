#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tether/constraints/core/numbers.h"
#include "tether/nlp/solver.h"
#include "tether/planning/plan/report.h"
#include "tether/planning/skeleton/action.h"
#include "tether/robot/model.h"
#include "tether/scene/scene.h"
#include "tether/symbolic/grounding/task.h"
#include "tether/task/goal/product.h"

namespace tether::planning {

/// The arm that acts.
struct ActingRobot {
  std::string name;
  std::shared_ptr<const robot::Model> model;  ///< Null: plan without an arm.
  math::Pose X_WBase;
  math::Pose X_WHand;      ///< The hand's pose at the start.
  Eigen::VectorXd q;       ///< Its joints then, rad; empty: the model's home.
  std::string holds = {};  ///< What the hand holds at the start, as it lies in it; empty: nothing.
};

/// Weights of the objective's parts: α and β of paper A, eq. (4).
struct Weights {
  double translation = constraints::kTravelWeight;  ///< 1/m² of squared distances, 1/m of lengths.
  double rotation = constraints::kTurnWeight;       ///< 1/rad² of squared angles, 1/rad of angles.
};

/// What is summed over the moves of the hand from one key pose to the next.
enum class Objective {
  kSquares,  ///< Squared distances and angles, paper A, eq. (4): a stop in between lowers the sum.
  kLength,   ///< Distances and angles: a stop never lowers the sum.
};

/// How key poses are optimised.
struct ProgramOptions {
  Weights weights;
  Objective objective = Objective::kSquares;
  bool home = true;                 ///< The hand returns to its start at the end.
  double hand_clearance = 0.002;    ///< Between the open hand and everything else, m.
  double object_clearance = 0.015;  ///< Between carried objects and everything else, where there is room, m.
  double feasible_m = constraints::kFeasibleLength;   ///< The checker's tolerances, m …
  double feasible_rad = constraints::kFeasibleAngle;  ///< … and rad.
  nlp::Backend backend = nlp::Backend::kNative;
  nlp::Options solver;  ///< Except max_iterations: see below.
  /// Iterations of one solve, in the backend's own unit; none: as the backend needs (EffortOf).
  std::optional<int> max_iterations;
  int max_variants = 40;  ///< Mode assignments (grasps, contacts, …) tried per candidate.
  int starts = 3;  ///< Starts per mode assignment: the first from the scene; the others, if none is accepted
                   ///< from there, displaced at random, the last with less clearance.
};

/// How candidates are searched for. All but kGreedy bring them in the order of their cost.
enum class SearchMethod {
  kAstar,     ///< By landmark cuts.
  kGreedy,    ///< The first one fast, whatever it costs; if it is not enough, the others by kAstar.
  kDijkstra,  ///< Without a heuristic.
  kBfs,       ///< Without a heuristic, by the number of actions.
};

/// Limits of the search for candidates.
struct SearchOptions {
  SearchMethod method = SearchMethod::kAstar;
  int max_actions = 0;  ///< 0: no limit.
  /// The number of best plans wanted; 0: every candidate. None: the best one, with the candidates met until
  /// it was found.
  std::optional<int> max_plans;
  /// Unless every candidate is wanted, planning ends after candidate max(min_candidates, patience · k), where
  /// the k-th was the last that improved the wanted plans; not before these are found.
  int min_candidates = 16;
  double patience = 2;
  std::vector<std::string> not_first;  ///< No plan begins with one of these actions.
  int max_candidates = 0;              ///< Planning gives up after so many without a plan; 0: no limit.
  double time_limit_s = 0;             ///< Wall clock; 0: no limit.
  size_t memory_limit = 0;             ///< Bytes that the process may occupy; 0: no limit.
  /// The cost of key poses does not count: the cheapest feasible action sequence is best, and sequences are
  /// tried one by one.
  bool cheapest_only = false;
  int threads = 1;
  uint64_t seed = 1;
  const std::atomic<bool>* stop = nullptr;
};

/// The input of planning. Immutable while planning.
struct Problem {
  std::string title;
  scene::Scene scene;
  std::vector<ActionSchema> actions;
  std::vector<ConstraintSpec> constraints;  ///< Hold at every step.
  std::optional<task::TemporalGoal> goal;   ///< In place of the task's own.
  ActingRobot robot;
  std::vector<ActingRobot> others;  ///< Arms that stand still.
  bool motion = false;              ///< Plan the arm's motions of the best plan.
  ProgramOptions program;
  SearchOptions search;
};

/// Called once per candidate, in order, as soon as its outcome is known.
using CandidateCallback = std::function<void(const CandidateReport&)>;

/// Enumerates candidates for `task`, optimises each over its key poses, judges each with the independent
/// checker. Outcomes are in the report; throws InputError for constraints whose parameters are wrong.
PlanReport PlanTask(const Problem& problem, const symbolic::Task& task,
                    const CandidateCallback& on_candidate = {});

}  // namespace tether::planning
