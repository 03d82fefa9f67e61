#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tether/common/limits.h"
#include "tether/planning/plan/problem.h"
#include "tether/scenario/scenario.h"

namespace tether::scenario {

/// Options of the command line about planning; each overrides the scenario's key of the same meaning.
struct PlanningOverrides {
  std::string solver;  ///< Empty: the scenario's.
  std::string goal;    ///< Temporal formula; empty: the scenario's goal.
  std::string
      semantics;  ///< Of the formula, the scenario's if `goal` is empty: cosafe or ltlf. Empty: as it is.
  std::string search;  ///< One of SearchNames(); empty: astar.
  std::optional<int> max_actions;
  std::optional<int> max_plans;
  std::optional<uint64_t> seed;
  std::optional<int> threads;
  std::optional<double> time_limit_s;
  size_t memory_limit = kDefaultMemoryLimit;  ///< Bytes; 0: no limit.
  std::optional<int> max_iterations;
  bool no_robot = false;
  bool no_motion = false;  ///< Key poses alone, without the arm's motions between them.
  bool trace = false;      ///< Record every iteration.
  const std::atomic<bool>* stop = nullptr;
};

/// The planning problem of a scenario. `scene` gives the initial poses: the scenario's own scene, or a
/// perturbed one. Throws InputError for what can't be planned: a scenario without a task, a wrong override.
planning::Problem MakeProblem(const Scenario& scenario, const scene::Scene& scene,
                              const PlanningOverrides& overrides);

/// "astar", "greedy", "dijkstra" and "bfs", in the order of planning::SearchMethod.
const std::vector<std::string>& SearchNames();

/// A temporal formula from the command line. Throws InputError if it can't be read; logs what is allowed and
/// probably not meant.
task::TemporalGoal ReadTemporalGoal(const std::string& formula, const std::string& semantics);

/// The scenario's grounded PDDL problem. Throws InputError if it has none, and LimitReached.
std::shared_ptr<const symbolic::Task> MakeTask(const Scenario& scenario, const Limits& limits = {});

/// Adds to the initial state of `problem`, whose predicate has one parameter, that it holds for what the
/// acting robot reaches in `scene`, as `within_reach` asks for. `where`: of the facts.
void AddWithinReach(const Scenario& scenario, const scene::Scene& scene, int predicate, const Location& where,
                    symbolic::Problem& problem);

/// The robot that acts: the first of the scenario; null if there is none.
const scene::Robot* ActingRobot(const scene::Scene& scene);

}  // namespace tether::scenario
