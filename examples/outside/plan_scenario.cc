// Plans a scenario with an installed Tether, outside of its source tree: plan_scenario [SCENARIO]

#include <cstdio>
#include <exception>
#include <string>

#include <tether/planning/plan/report.h>
#include <tether/robot/model.h>
#include <tether/scenario/problem.h>
#include <tether/scenario/scenario.h>

int main(int argc, char** argv) {
  using namespace tether;
  try {
    const std::string file = argc > 1 ? argv[1] : robot::DataDirectory() + "/scenarios/hanoi.yaml";
    const scenario::Scenario read = scenario::LoadScenario(file);
    const auto task = scenario::MakeTask(read);
    const planning::PlanReport plans = planning::PlanTask(scenario::MakeProblem(read, read.scene, {}), *task);
    if (plans.best() == nullptr) return 1;
    for (const std::string& action : plans.best()->plan.actions) std::puts(action.c_str());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
