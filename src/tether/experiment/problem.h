#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "tether/experiment/scenario.h"
#include "tether/planning/problem.h"

namespace tether::experiment {

/// What the command line may say about planning; each overrides the scenario's key of the same meaning.
struct PlanningOverrides {
  std::string solver;  ///< Empty: the scenario's.
  std::optional<int> max_actions;
  std::optional<int> max_plans;
  std::optional<uint64_t> seed;
  std::optional<int> threads;
  std::optional<double> time_limit_s;
  std::optional<int> max_iterations;
  bool no_robot = false;
  bool trace = false;  ///< Record every iteration.
  const std::atomic<bool>* stop = nullptr;
};

/// A scenario made ready for planning. `scene` is where things stand: the scenario's own scene, or a
/// perturbed one. Throws InputError for what can't be planned: a temporal goal, a scenario without a task, a
/// wrong override.
planning::Problem MakeProblem(const Scenario& scenario, const scene::Scene& scene,
                              const PlanningOverrides& overrides);

/// The scenario's grounded PDDL problem. Throws InputError if it has none.
std::shared_ptr<const symbolic::Task> MakeTask(const Scenario& scenario);

/// The robot that acts: the first of the scenario; null if there is none.
const scene::Robot* ActingRobot(const scene::Scene& scene);

}  // namespace tether::experiment
