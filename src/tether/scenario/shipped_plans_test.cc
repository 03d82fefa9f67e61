// What planning finds in the shipped scenarios: skeletons, and costs to 1e-9. They may change for a reason
// only; then TETHER_UPDATE_PLANS=1 writes testing/scenario/shipped_plans.yaml anew.

#include <cmath>
#include <cstdlib>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/common/document/value.h"
#include "tether/common/file.h"
#include "tether/scenario/problem.h"

namespace tether::scenario {
namespace {

const std::string kSource = TETHER_SOURCE_DIR;
const std::string kPinned = kSource + "/testing/scenario/shipped_plans.yaml";
constexpr double kSameCost = 1e-9;  // relative to 1 + cost

planning::PlanReport Plan(const std::string& name) {
  const Scenario scenario = LoadScenario(kSource + "/scenarios/" + name + ".yaml");
  PlanningOverrides overrides;
  overrides.threads = 1;
  return planning::PlanTask(MakeProblem(scenario, scenario.scene, overrides), *MakeTask(scenario));
}

std::string Skeleton(const planning::CandidateReport& candidate) {
  std::string text;
  for (const std::string& action : candidate.plan.actions) text += (text.empty() ? "" : " ") + action;
  return text;
}

/// The plans of the scenario as they are pinned, a line each.
std::string Lines(const std::string& name, const planning::PlanReport& report) {
  std::string text = name + ":\n";
  for (const planning::CandidateReport& candidate : report.candidates) {
    if (!candidate.feasible()) continue;
    text +=
        "- {cost: " + Value(candidate.plan.cost).AsText() + ", skeleton: \"" + Skeleton(candidate) + "\"}\n";
  }
  return text;
}

const char* const kScenarios[] = {"assistive", "cups",     "hanoi",    "parts",
                                  "press",     "stacking", "tool_use", "workspace_reach"};

TEST(ShippedPlansTest, SkeletonsAndCostsAreAsTheyWere) {
  if (std::getenv("TETHER_UPDATE_PLANS") != nullptr) {
    std::string text = "# Feasible plans of the shipped scenarios, see shipped_plans_test.cc.\n";
    for (const char* name : kScenarios) text += Lines(name, Plan(name));
    WriteFile(kPinned, text);
  }
  const Value pinned = ReadYaml(kPinned);
  for (const char* name : kScenarios) {
    const planning::PlanReport report = Plan(name);
    const Value* plans = pinned.Find(name);
    ASSERT_NE(plans, nullptr) << name;
    size_t i = 0;
    for (const planning::CandidateReport& candidate : report.candidates) {
      if (!candidate.feasible()) continue;
      ASSERT_LT(i, plans->items().size()) << name << " has a new plan: " << Skeleton(candidate);
      const Value& plan = plans->items()[i++];
      EXPECT_EQ(Skeleton(candidate), plan.Find("skeleton")->AsText()) << name;
      const double cost = plan.Find("cost")->number();
      EXPECT_NEAR(candidate.plan.cost, cost, kSameCost * (1 + cost)) << name << ": " << Skeleton(candidate);
    }
    EXPECT_EQ(i, plans->items().size()) << name << " has lost a plan";
  }
}

}  // namespace
}  // namespace tether::scenario
