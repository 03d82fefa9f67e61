// Plans a task: action sequences from PDDL, their key poses from the native solver, the verdict from the
// independent checker. Exits with 1 if anything is not as it should be, so that the tests can run it.

#include <cstdio>

#include "tether/planning/check/checker.h"
#include "tether/planning/plan/problem.h"
#include "tether/robot/model.h"
#include "tether/scenario/problem.h"

int main() {
  using namespace tether;
  const scenario::Scenario reach =
      scenario::LoadScenario(robot::DataDirectory() + "/scenarios/workspace_reach.yaml");
  const planning::Problem problem = scenario::MakeProblem(reach, reach.scene, {});
  const planning::PlanReport report = planning::PlanTask(problem, *scenario::MakeTask(reach));
  for (int i : report.BestFirst()) {
    const planning::CandidateReport& candidate = report.candidates[static_cast<size_t>(i)];
    std::printf("%-10s cost %.4f  ", planning::ToString(candidate.status).c_str(), candidate.plan.cost);
    for (const std::string& action : candidate.plan.actions) std::printf(" %s", action.c_str());
    std::printf("\n");
  }
  const planning::CandidateReport* best = report.best();
  if (best == nullptr) return 1;

  // A plan is a chain of poses tied to objects: each step brings a frame to a pose relative to another frame.
  for (const planning::PlanStep& step : best->plan.steps) {
    std::printf("%s: %s in %s at (%.3f, %.3f, %.3f) m\n", step.action.c_str(), step.control.c_str(),
                step.target.c_str(), step.X_TC.p.x(), step.X_TC.p.y(), step.X_TC.p.z());
  }
  // The checker shares no code with the optimiser's rows. Feasible: every constraint to 1 mm and 5 mrad.
  return planning::CheckPlan(problem, best->plan).Feasible(problem.program) ? 0 : 1;
}
