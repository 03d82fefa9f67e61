#include "testing/evaluation/plan_and_run.h"

#include "tether/scenario/perturb.h"
#include "tether/scenario/problem.h"

namespace tether::evaluation {

PlannedRun PlanAndRun(const scenario::Scenario& scenario, const RunOptions& options) {
  const auto task = scenario::MakeTask(scenario);
  const scene::Scene scene = scenario::PerturbScene(scenario.scene, scenario.perturb, options.seed);
  scenario::PlanningOverrides overrides;
  overrides.seed = options.seed;
  PlannedRun outcome;
  outcome.planning = planning::PlanTask(scenario::MakeProblem(scenario, scene, overrides), *task);
  if (const planning::CandidateReport* best = outcome.planning.best(); best != nullptr)
    outcome.run = RunPlan(scenario, scene, *task, best->plan, options);
  return outcome;
}

}  // namespace tether::evaluation
