// Metamorphic laws of planning: turning or renaming the whole world, or writing its file in another order,
// changes nothing. Costs are those of all feasible candidates; ties may come in any order.

#include <algorithm>
#include <numbers>
#include <regex>

#include <gtest/gtest.h>

#include "testing/scenario/test_scenarios.h"
#include "tether/common/document/value.h"
#include "tether/common/file.h"
#include "tether/math/pose.h"
#include "tether/scenario/problem.h"

namespace tether::scenario {
namespace {

constexpr int kAngles = 24;
constexpr double kSame = 1e-6;
// Joint 1 keeps this far from its limits where only the scene is turned, rad.
constexpr double kJointRoom = 0.6;

planning::PlanReport Plan(const Scenario& scenario, const scene::Scene& scene) {
  PlanningOverrides overrides;
  overrides.threads = 2;
  return planning::PlanTask(MakeProblem(scenario, scene, overrides), *MakeTask(scenario));
}

std::vector<double> Costs(const planning::PlanReport& report) {
  std::vector<double> costs;
  for (const planning::CandidateReport& candidate : report.candidates) {
    if (candidate.feasible()) costs.push_back(candidate.plan.cost);
  }
  std::sort(costs.begin(), costs.end());
  return costs;
}

void ExpectSame(const std::vector<double>& costs, const std::vector<double>& expected,
                const std::string& what, double same = kSame) {
  ASSERT_EQ(costs.size(), expected.size()) << what;
  for (size_t i = 0; i < costs.size(); ++i) EXPECT_NEAR(costs[i], expected[i], same) << what << ", " << i;
}

/// All that stands in the world, turned about its z axis; the robots only if asked for.
scene::Scene Turned(scene::Scene scene, double angle, bool robots) {
  const math::Pose X_VW(math::RotationFromRpy({0, 0, angle}), {0, 0, 0});
  for (scene::Object& object : scene.objects) {
    if (object.parent == scene::kWorld) object.X_ParentObject = X_VW * object.X_ParentObject;
  }
  for (scene::Region& region : scene.regions) {
    if (region.parent == scene::kWorld) region.X_ParentRegion = X_VW * region.X_ParentRegion;
  }
  for (scene::Robot& robot : scene.robots) {
    if (robots && robot.parent == scene::kWorld) robot.X_ParentBase = X_VW * robot.X_ParentBase;
    // The hand begins where it would have.
    if (!robots) robot.q.front() += angle;
  }
  return scene;
}

std::string Renamed(std::string text, const std::vector<std::pair<std::string, std::string>>& names) {
  for (const auto& [from, to] : names) text = std::regex_replace(text, std::regex("\\b" + from + "\\b"), to);
  return text;
}

/// The shipped scenario with other names.
Scenario ShippedRenamed(const std::string& name,
                        const std::vector<std::pair<std::string, std::string>>& names) {
  const std::string folder = std::string(TETHER_SOURCE_DIR) + "/scenarios/";
  std::map<std::string, std::string> files{{"scenario.yaml", ReadFile(folder + name + ".yaml")}};
  for (const std::string file : {"/domain.pddl", "/problem.pddl"})
    files[name + file] = ReadFile(folder + name + file);
  for (auto& [path, text] : files) {
    if (path != "scenario.yaml") text = Renamed(text, names);
  }
  // "box" is also the word for a form.
  std::string& scenario = files.at("scenario.yaml");
  for (const auto& [from, to] : names) {
    scenario = std::regex_replace(scenario, std::regex("\n  " + from + ":"), "\n  " + to + ":");
    scenario = std::regex_replace(scenario, std::regex("parent: " + from + "\\b"), "parent: " + to);
  }
  return LoadScenario("scenario.yaml", files);
}

class Laws : public ::testing::TestWithParam<std::string> {};

TEST_P(Laws, TurnedAsAWholeWithTheBase) {
  const Scenario scenario = Shipped(GetParam());
  const std::vector<double> expected = Costs(Plan(scenario, scenario.scene));
  ASSERT_FALSE(expected.empty());
  for (int i = 1; i < kAngles; ++i) {
    const double angle = 2 * std::numbers::pi * i / kAngles;
    ExpectSame(Costs(Plan(scenario, Turned(scenario.scene, angle, true))), expected,
               "turned by " + std::to_string(angle));
  }
}

TEST_P(Laws, TurnedAsAWholeBeforeTheBase) {
  Scenario scenario = Shipped(GetParam());
  const robot::Model& model = *scenario.models.begin()->second;
  const planning::PlanReport report = Plan(scenario, scenario.scene);
  const std::vector<double> expected = Costs(report);
  double lowest = scenario.scene.robots[0].q.front(), highest = lowest;
  for (const planning::CandidateReport& candidate : report.candidates) {
    for (const planning::PlanStep& step : candidate.plan.steps) {
      if (step.q.size() == 0) continue;
      lowest = std::min(lowest, step.q[0]);
      highest = std::max(highest, step.q[0]);
    }
  }
  // Not yet what it should be: where joints are variables (the hook on the shelf), ties of distances between
  // links and things let the solver settle at 34 iterations, 5e-5 beside where it does at some other angles.
  const double same = GetParam() == "workspace_reach" ? 1e-4 : kSame;
  int turned = 0;
  for (int i = 1; i < kAngles; ++i) {
    const double angle = std::remainder(2 * std::numbers::pi * i / kAngles, 2 * std::numbers::pi);
    if (lowest + angle < model.lower()[0] + kJointRoom || highest + angle > model.upper()[0] - kJointRoom)
      continue;
    ++turned;
    ExpectSame(Costs(Plan(scenario, Turned(scenario.scene, angle, false))), expected,
               "turned by " + std::to_string(angle), same);
  }
  EXPECT_GT(turned, 6);
}

TEST_P(Laws, WrittenInAnotherOrder) {
  Scenario scenario = Shipped(GetParam());
  const std::vector<double> expected = Costs(Plan(scenario, scenario.scene));
  std::reverse(scenario.scene.objects.begin(), scenario.scene.objects.end());
  ExpectSame(Costs(Plan(scenario, scenario.scene)), expected, "reversed");
  std::rotate(scenario.scene.objects.begin(), scenario.scene.objects.begin() + 2,
              scenario.scene.objects.end());
  ExpectSame(Costs(Plan(scenario, scenario.scene)), expected, "rotated");
}

TEST_P(Laws, WithOtherNames) {
  const Scenario scenario = Shipped(GetParam());
  std::vector<std::pair<std::string, std::string>> names;
  // In the other order of the alphabet.
  std::vector<std::string> old;
  for (const scene::Object& object : scenario.scene.objects) old.push_back(object.name);
  std::sort(old.rbegin(), old.rend());
  for (size_t i = 0; i < old.size(); ++i) names.emplace_back(old[i], "thing" + std::to_string(100 + i));
  const Scenario renamed = ShippedRenamed(GetParam(), names);
  ExpectSame(Costs(Plan(renamed, renamed.scene)), Costs(Plan(scenario, scenario.scene)), "renamed");
}

INSTANTIATE_TEST_SUITE_P(Scenarios, Laws, ::testing::Values("workspace_reach", "hanoi", "stacking"));

}  // namespace
}  // namespace tether::scenario
