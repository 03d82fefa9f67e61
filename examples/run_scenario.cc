// Reads a scenario, plans it, executes the best plan in simulation, and judges the goal
// from the simulator's true poses.

#include <cstdio>

#include "tether/evaluation/run.h"
#include "tether/robot/model.h"
#include "tether/scenario/events.h"
#include "tether/scenario/problem.h"

int main() {
  using namespace tether;
  const std::string folder = robot::DataDirectory() + "/scenarios/";
  const scenario::Scenario reach = scenario::LoadScenario(folder + "workspace_reach.yaml");
  const auto task = scenario::MakeTask(reach);
  const planning::PlanReport plans = planning::PlanTask(scenario::MakeProblem(reach, reach.scene, {}), *task);
  if (plans.best() == nullptr) return 1;

  evaluation::RunOptions options;
  options.seed = 1;
  options.on_event = [](double time, const std::string& kind, const std::string& text) {
    std::printf("%7.2f s  %-12s %s\n", time, kind.c_str(), text.c_str());
  };
  const evaluation::RunReport run =
      evaluation::RunPlan(reach, reach.scene, *task, plans.best()->plan, options);
  std::printf("%s after %.1f s: %s\n", evaluation::ToString(run.status).c_str(), run.sim_time_s,
              run.reason.c_str());
  for (const evaluation::GoalFact& fact : run.judgement.facts)
    std::printf("%s is %s\n", fact.atom.c_str(), fact.holds ? "true" : "false");
  return run.ok() ? 0 : 1;
}
