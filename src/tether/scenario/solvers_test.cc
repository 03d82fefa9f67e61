// Every solver plans every shipped scene. Find nlopt_never_plans.

#include <algorithm>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/needs_plugin.h"
#include "testing/scenario/test_scenarios.h"
#include "tether/planning/program/effort.h"
#include "tether/scenario/problem.h"

namespace tether::scenario {
namespace {

struct Case {
  std::string solver, scenario;
};

/// Costs of the feasible candidates, cheapest first: those of Table I, and of the other scenes.
const std::map<std::string, std::vector<double>>& KnownCosts() {
  static const std::map<std::string, std::vector<double>> costs = {
      {"workspace_reach", {0.3252, 0.3269, 0.4260}},
      {"hanoi", {0.4894, 0.5486}},
      {"tool_use", {0.2878, 0.3761}},
      {"stacking", {1.1636}},
      {"press", {0.1424}},
      {"parts", {0.7143}}};
  return costs;
}

planning::PlanReport Plan(const Case& what, std::optional<int> max_iterations = {}) {
  const Scenario scenario = Shipped(what.scenario);
  PlanningOverrides overrides;
  overrides.solver = what.solver;
  overrides.threads = 1;
  overrides.max_iterations = max_iterations;
  return planning::PlanTask(MakeProblem(scenario, scenario.scene, overrides), *MakeTask(scenario));
}

class EverySolver : public ::testing::TestWithParam<Case> {};

TEST_P(EverySolver, NloptNeverPlans) {
  if (GetParam().solver != "native") TETHER_NEEDS_PLUGIN(GetParam().solver);
  const planning::PlanReport report = Plan(GetParam());
  ASSERT_TRUE(report.ok()) << report.message;
  EXPECT_TRUE(report.complete);
  std::vector<double> costs;
  for (const planning::CandidateReport& candidate : report.candidates) {
    EXPECT_TRUE(candidate.feasible()) << candidate.reason;
    EXPECT_LE(candidate.max_violation_m, 1e-3);
    EXPECT_LE(candidate.max_violation_rad, 5e-3);
    costs.push_back(candidate.plan.cost);
  }
  std::sort(costs.begin(), costs.end());
  const std::vector<double>& known = KnownCosts().at(GetParam().scenario);
  ASSERT_EQ(costs.size(), known.size());
  // Parts has several optima far apart.
  if (GetParam().scenario == "parts") return;
  for (size_t i = 0; i < costs.size(); ++i) {
    // Tool Use has a second optimum, at which NLopt ends; so has Workspace Reach where the hook is put on the
    // shelf and the arm's joints are variables.
    const bool several =
        GetParam().scenario == "tool_use" || (GetParam().scenario == "workspace_reach" && i == 2);
    EXPECT_NEAR(costs[i], known[i], (several ? 0.06 : 0.003) * known[i]) << i;
  }
}

std::vector<Case> Cases() {
  std::vector<Case> cases;
  for (const char* solver : {"native", "ipopt", "nlopt"}) {
    for (const auto& [scenario, costs] : KnownCosts()) {
      // From most of its starts on Parts, IPOPT ends in an infeasible local minimum.
      if (scenario != "parts" || solver != std::string("ipopt")) cases.push_back({solver, scenario});
    }
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Scenarios, EverySolver, ::testing::ValuesIn(Cases()),
                         [](const auto& test) { return test.param.solver + "_" + test.param.scenario; });

// max_iterations is the number of iterations with every solver, be it more or fewer than needed.
TEST(MaxIterationsTest, IsTheBoundOfOneSolve) {
  TETHER_NEEDS_PLUGIN("ipopt");
  TETHER_NEEDS_PLUGIN("nlopt");
  EXPECT_FALSE(Plan({"nlopt", "stacking"}, 5).ok());
  for (const char* solver : {"native", "ipopt", "nlopt"}) {
    EXPECT_TRUE(Plan({solver, "stacking"}, 20'000).ok()) << solver;
  }
  planning::ProgramOptions options;
  options.max_iterations = 700;
  for (const nlp::Backend backend : {nlp::Backend::kNative, nlp::Backend::kIpopt, nlp::Backend::kNlopt}) {
    options.backend = backend;
    EXPECT_EQ(planning::EffortOf(options).first, 700);
    EXPECT_EQ(planning::EffortOf(options).restart, 700);
  }
}

}  // namespace
}  // namespace tether::scenario
