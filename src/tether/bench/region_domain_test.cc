#include "tether/planning/modes/region_domain.h"

#include <algorithm>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/scratch_folder.h"
#include "testing/scenario/test_scenarios.h"
#include "tether/bench/bench_task.h"
#include "tether/common/file.h"
#include "tether/common/random.h"
#include "tether/ltl/formula/parser.h"
#include "tether/planning/plan/plan_file.h"
#include "tether/scenario/problem.h"
#include "tether/task/search/skeleton.h"

namespace tether::bench {
namespace {

using symbolic::Task;
using ::testing::HasSubstr;

/// Actions of a controller that chooses all poses itself.
const std::string kActions = R"(format: tether.actions/1
move: {parameters: [r], steps: [{control: hand, target: {region: r}}]}
hold: {parameters: [o, r], steps: [{control: o, target: {region: r}}]}
grasp: {parameters: [o, r], steps: [{control: hand, target: {region: r}}]}
place: {parameters: [o, r], steps: [{control: o, target: {region: r}}]}
)";

/// Regions a, b, c side by side, the cup in a and the plate in b.
const std::string kScene = R"(format: tether.scenario/1
robots: {panda: {model: panda}}
objects:
  table: {shape: {box: [1, 1, 0.1]}, pose: {position: [0.5, 0, -0.05]}}
  cup: {shape: {box: [0.04, 0.04, 0.1]}, mass: 0.1, pose: {parent: a, position: [0, 0, 0.05]}}
  plate: {shape: {box: [0.1, 0.1, 0.02]}, mass: 0.1, pose: {parent: b, position: [0, 0, 0.01]}}
regions:
  a: {disc: 0.08, capacity: 1, pose: {position: [0.5, -0.2, 0]}}
  b: {disc: 0.08, capacity: 1, pose: {position: [0.5, 0, 0]}}
  c: {disc: 0.08, capacity: 1, pose: {position: [0.5, 0.2, 0]}}
  above: {sphere: 0.05, hub: true, pose: {position: [0.5, 0, 0.3]}}
groups: {sides: [a, c]}
actions: [actions.yaml]
)";

class RegionDomainTest : public ::testing::Test {
 protected:
  void SetUp() override { WriteFile(folder_ + "/actions.yaml", kActions); }

  scenario::Scenario Load(const std::string& text) const {
    WriteFile(folder_ + "/s.yaml", text);
    return scenario::LoadScenario(folder_ + "/s.yaml");
  }

  std::string ErrorOf(const std::string& text) const {
    try {
      const scenario::Scenario scenario = Load(text);
      task::Product(scenario::MakeTask(scenario), scenario.goal);
    } catch (const InputError& error) {
      return scenario::Without(error.what(), folder_ + "/");
    }
    return "";
  }

  static planning::PlanReport Plan(const scenario::Scenario& scenario,
                                   const scenario::PlanningOverrides& overrides = {}) {
    return planning::PlanTask(scenario::MakeProblem(scenario, scenario.scene, overrides),
                              *scenario::MakeTask(scenario));
  }

  ScratchFolder scratch_;
  const std::string folder_ = scratch_.path().string();
};

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

TEST_F(RegionDomainTest, PlansATemporalGoalWithoutPddl) {
  const scenario::Scenario scenario = Load(kScene + "task: {goal: 'F(in(plate,sides) & X F in(plate,b))'}\n");
  const planning::PlanReport report = Plan(scenario);
  ASSERT_EQ(report.status, planning::PlanStatus::kSolved) << report.message;
  EXPECT_TRUE(report.complete);
  const planning::Plan& plan = report.best()->plan;
  // To b, to c, and back again; a is occupied.
  EXPECT_EQ(plan.actions, (std::vector<std::string>{"move(b)", "grasp(plate,b)", "hold(plate,above)",
                                                    "hold(plate,c)", "place(plate,c)", "grasp(plate,c)",
                                                    "hold(plate,above)", "hold(plate,b)", "place(plate,b)"}));
  EXPECT_EQ(plan.cost, 9);
  ASSERT_EQ(plan.steps.size(), 9u);
  EXPECT_TRUE(plan.steps[3].target_is_region);
  EXPECT_EQ(plan.steps[3].control, "plate");
  EXPECT_EQ(plan.steps[3].target, "c");
  EXPECT_EQ(plan.steps[3].action_index, 3);

  // Written and read again.
  const Value written = planning::WritePlan(plan, {"t", 1, "s"}, scenario.scene, scenario.actions);
  Diagnostics mistakes;
  const planning::Plan read =
      planning::ParsePlan(ParseYaml(WriteJson(written), "plan"), scenario.scene, scenario.actions, mistakes);
  EXPECT_TRUE(mistakes.empty());
  ASSERT_EQ(read.steps.size(), plan.steps.size());
  EXPECT_TRUE(read.steps[3].target_is_region);
  EXPECT_EQ(read.steps[3].target, "c");
}

// find regions_that_overlap.
TEST_F(RegionDomainTest, ObjectsCountInEveryRegionThatTheyAreIn) {
  // c is where b is, so the plate is in both, and has to go before the cup may come.
  const std::string same = Replaced(kScene, "c: {disc: 0.08, capacity: 1, pose: {position: [0.5, 0.2, 0]}}",
                                    "c: {disc: 0.08, capacity: 1, pose: {position: [0.5, 0, 0]}}\n"
                                    "  d: {disc: 0.08, capacity: 1, pose: {position: [0.5, 0.3, 0]}}");
  planning::PlanReport report = Plan(Load(same + "task: {goal: 'F in(cup,c)'}\n"));
  ASSERT_TRUE(report.ok()) << report.message;
  EXPECT_THAT(report.best()->plan.actions, ::testing::Contains(HasSubstr("place(plate,d)")));
  // What is placed in one is in the other, without further actions.
  report = Plan(Load(same + "task: {goal: 'F(in(plate,b) & in(plate,c))'}\n"));
  ASSERT_TRUE(report.ok()) << report.message;
  EXPECT_TRUE(report.best()->plan.actions.empty());
  EXPECT_FALSE(Plan(Load(same + "task: {goal: 'F(in(plate,b) & !in(plate,c))'}\n")).ok());

  // Siblings: three, and one inside of a larger one for two.
  const std::string nested =
      Replaced(kScene, "c: {disc: 0.08, capacity: 1, pose: {position: [0.5, 0.2, 0]}}",
               "c: {rectangle: [0.6, 0.6], capacity: 2, pose: {position: [0.5, 0, 0]}}\n"
               "  d: {disc: 0.08, capacity: 1, pose: {position: [0.5, 0.4, 0]}}");
  report = Plan(Load(nested + "task: {goal: 'F(in(cup,d) & X F(in(cup,a) & in(cup,c)))'}\n"));
  ASSERT_TRUE(report.ok()) << report.message;
  EXPECT_EQ(report.best()->plan.actions.back(), "place(cup,a)");
}

TEST_F(RegionDomainTest, EverySearchFindsTheSameCost) {
  const scenario::Scenario scenario =
      Load(kScene + "task: {goal: {ltl: 'F(in(cup,b) & in(plate,a)) & F in(cup,c)'}}\n");
  double cost = -1;
  for (const std::string& search : scenario::SearchNames()) {
    scenario::PlanningOverrides overrides;
    overrides.search = search;
    const planning::PlanReport report = Plan(scenario, overrides);
    ASSERT_EQ(report.status, planning::PlanStatus::kSolved) << search;
    if (search == "greedy") {
      EXPECT_GE(report.best()->plan.cost, 17);
    } else {
      EXPECT_EQ(report.best()->plan.cost, cost < 0 ? report.best()->plan.cost : cost) << search;
      cost = report.best()->plan.cost;
    }
  }
  EXPECT_EQ(cost, 17);
  scenario::PlanningOverrides overrides;
  overrides.goal = "F in(cup,c) & F in(plate,nowhere)";
  EXPECT_THROW(Plan(scenario, overrides), InputError);
  overrides.goal = "F in(cup,c)";
  EXPECT_EQ(Plan(scenario, overrides).best()->plan.cost, 5);
}

TEST_F(RegionDomainTest, WhatGeometryRefutesIsPlannedAround) {
  // The plate does not fit into c any more: the cup makes room for it in a.
  const std::string narrow = Replaced(kScene, "c: {disc: 0.08", "c: {disc: 0.06");
  planning::PlanReport report = Plan(Load(narrow + "task: {goal: 'F(in(plate,sides) & X F in(plate,b))'}\n"));
  ASSERT_EQ(report.status, planning::PlanStatus::kSolved);
  const std::vector<std::string>& actions = report.best()->plan.actions;
  EXPECT_NE(std::find(actions.begin(), actions.end(), "place(plate,a)"), actions.end());
  EXPECT_EQ(report.candidates.front().status, planning::CandidateStatus::kInfeasible);
  EXPECT_EQ(report.candidates.front().reason,
            "hold(plate,c): the footprint of 'plate' does not fit into 'c'");

  report = Plan(Load(narrow + "task: {goal: 'F in(plate,c)'}\n"));
  EXPECT_EQ(report.status, planning::PlanStatus::kImpossible);
  EXPECT_THAT(report.message, HasSubstr("the footprint of 'plate' does not fit into 'c'"));

  const std::string far = Replaced(kScene, "position: [0.5, 0.2, 0]", "position: [0.5, 3, 0]");
  report = Plan(Load(far + "task: {goal: 'F in(cup,c)'}\n"));
  EXPECT_EQ(report.status, planning::PlanStatus::kImpossible);
  EXPECT_THAT(report.message, HasSubstr("'c' is out of reach of 'panda' by"));
  // Less far, that is no proof; where another region will do, it is planned with that.
  const std::string hardly = Replaced(kScene, "position: [0.5, 0.2, 0]", "position: [0.5, 0.8, 0]");
  report = Plan(Load(hardly + "task: {goal: 'F in(cup,c)'}\n"));
  EXPECT_EQ(report.status, planning::PlanStatus::kGaveUp);
  EXPECT_THAT(report.message, HasSubstr("with the hand straight down"));
  const std::string roomy =
      Replaced(Replaced(hardly, "b: {disc: 0.08, capacity: 1", "b: {disc: 0.08, capacity: 2"),
               "sides: [a, c]", "sides: [c, b]");
  report = Plan(Load(roomy + "task: {goal: 'F in(cup,sides)'}\n"));
  ASSERT_EQ(report.status, planning::PlanStatus::kSolved);
  EXPECT_EQ(report.best()->plan.actions.back(), "place(cup,b)");
}

TEST_F(RegionDomainTest, PddlGoalsWorkToo) {
  const scenario::Scenario scenario =
      Load(kScene + "task: {goal: {pddl: '(and (in plate sides) (in cup b))'}}\n");
  EXPECT_FALSE(scenario.goal.has_value());
  const double cost = Plan(scenario).best()->plan.cost;
  const scenario::Scenario temporal = Load(kScene + "task: {goal: 'F(in(plate,sides) & in(cup,b))'}\n");
  EXPECT_EQ(Plan(temporal).best()->plan.cost, cost);
}

TEST_F(RegionDomainTest, SaysWhatIsWrong) {
  const std::string task = "task: {goal: 'F in(cup,c)'}\n";
  EXPECT_EQ(
      ErrorOf(Replaced(kScene, "parent: a, position: [0, 0, 0.05]", "parent: a, position: [0.07, 0, 0.05]") +
              task),
      "s.yaml:5:3: object 'cup' is in no region: its footprint reaches 12.2 mm beyond 'a' (its whole "
      "footprint in a region, and standing there)");
  EXPECT_EQ(
      ErrorOf(Replaced(kScene, "parent: a, position: [0, 0, 0.05]", "parent: a, position: [0, 0, 0.15]") +
              task),
      "s.yaml:5:3: object 'cup' is in no region: it is 100.0 mm above or below 'a' (its whole footprint in a "
      "region, and standing there)");
  EXPECT_EQ(
      ErrorOf(Replaced(kScene, "parent: a, position: [0, 0, 0.05]", "parent: b, position: [0, 0, 0.05]") +
              task),
      "s.yaml:6:3: region 'b' holds 2 objects, 'cup' and 'plate', but has a capacity of 1 (no more objects "
      "than fit)");
  EXPECT_EQ(
      ErrorOf(Replaced(kScene, ", hub: true", "") + task),
      "s.yaml:14:7: no region connects the others, so the task needs a PDDL domain (a region with 'hub: "
      "true', or 'domain' and 'problem')");
  EXPECT_THAT(ErrorOf(kScene + "task: {goal: 'F in(cup,side)'}\n"),
              HasSubstr("there is no object 'side' (did you mean 'sides'?"));
  EXPECT_THAT(ErrorOf(kScene + "task: {goal: 'F(in(cup,c)'}\n"), HasSubstr("s.yaml:14:"));
  EXPECT_THAT(ErrorOf(kScene + "task: {goal: 'G in(cup,c)'}\n"), HasSubstr("not co-safe"));
  EXPECT_THAT(ErrorOf(Replaced(kScene, "actions: [actions.yaml]", "actions: [manipulation]") + task),
              HasSubstr("action 'move' has no geometry (actions: [regions]"));
}

TEST_F(RegionDomainTest, AnUnsatisfiableGoalIsImpossible) {
  const planning::PlanReport report = Plan(Load(kScene + "task: {goal: 'F(in(cup,c) & !in(cup,c))'}\n"));
  EXPECT_EQ(report.status, planning::PlanStatus::kImpossible);
  EXPECT_THAT(report.message, HasSubstr("unsatisfiable"));
}

std::shared_ptr<const Task> GroundLayout(const planning::RegionLayout& layout) {
  return Task::Ground(symbolic::ParseProblem(planning::RegionProblemText(layout), "problem",
                                             symbolic::ParseDomain(planning::RegionDomainText(), "domain")));
}

/// Objects in regions with random capacities, or with room for one in each.
planning::RegionLayout RandomLayout(Random& random, bool one_each = false) {
  planning::RegionLayout layout;
  layout.hub = "hub";
  const int regions = 2 + random.Index(3);
  std::vector<int> left;
  for (int i = 0; i < regions; ++i) {
    const int capacity = one_each ? 1 : random.Index(4);
    layout.regions.push_back({"r" + std::to_string(i), capacity});
    left.push_back(capacity == 0 ? 100 : capacity);
  }
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<size_t>(random.Index(regions));
    if (left[at]-- > 0) layout.items.push_back({"o" + std::to_string(i), layout.regions[at].name});
  }
  layout.groups["g"] = {"r0", "r1"};
  return layout;
}

/// Walks at random and looks whether the domain keeps count of what is where.
TEST(RegionLayoutTest, CapacitiesHold) {
  Random random(1);
  for (int trial = 0; trial < 60; ++trial) {
    const planning::RegionLayout layout = RandomLayout(random);
    const auto task = GroundLayout(layout);
    symbolic::State state = task->initial_state();
    std::vector<ActionId> applicable;
    for (int step = 0; step < 200; ++step) {
      std::map<std::string, int> held;
      const std::vector<std::string> facts = task->TrueAtoms(state, true);
      const auto holds = [&](const std::string& fact) {
        return std::find(facts.begin(), facts.end(), fact) != facts.end();
      };
      for (const planning::RegionLayout::Item& item : layout.items) {
        int places = holds("inhand(" + item.name + ")");
        bool in_group = false;
        for (const planning::RegionLayout::Place& region : layout.regions) {
          const bool in = holds("in(" + item.name + "," + region.name + ")");
          held[region.name] += in;
          places += in;
          in_group = in_group || (in && (region.name == "r0" || region.name == "r1"));
        }
        ASSERT_EQ(places, 1);
        ASSERT_EQ(holds("in(" + item.name + ",g)"), in_group);
      }
      task->FindApplicable(state, applicable);
      for (const planning::RegionLayout::Place& region : layout.regions) {
        if (region.capacity > 0) {
          ASSERT_LE(held[region.name], region.capacity);
        }
        // A hand that holds something in a region may release it exactly if there is room.
        if (!holds("at(" + region.name + ")") || holds("handempty()") || holds("handempty")) continue;
        const bool may = std::any_of(applicable.begin(), applicable.end(), [&](ActionId action) {
          return task->actions()[action].name.starts_with("place");
        });
        ASSERT_EQ(may, region.capacity == 0 || held[region.name] < region.capacity);
      }
      if (applicable.empty()) break;
      state = task->Apply(applicable[ToIndex(random.Index(static_cast<int>(applicable.size())))], state);
    }
  }
}

/// A temporal goal costs the same by A* and without a heuristic, and, where a region holds one object, with
/// regions cut into poses.
TEST(RegionLayoutTest, SearchesAndAbstractionsAgree) {
  Random random(2);
  int solved = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const bool one_each = trial % 2 == 0;
    const planning::RegionLayout layout = RandomLayout(random, one_each);
    if (layout.items.size() < 2) continue;
    const auto in = [&] {
      const auto& item = layout.items[random.Index(static_cast<int>(layout.items.size()))];
      const int area = random.Index(static_cast<int>(layout.regions.size()) + 1);
      return "in(" + item.name + "," +
             (area == 0 ? "g" : layout.regions[static_cast<size_t>(area) - 1].name) + ")";
    };
    const std::string text = "F(" + in() + " & " + in() + ") & F(" + in() + " & X F !" + in() + ")";
    const auto cost = [&](const std::shared_ptr<const Task>& task, bool blind) {
      const task::TemporalGoal goal{ltl::ParseFormula(text), ltl::Semantics::kCosafe, {}};
      task::SkeletonSearch search(std::make_unique<task::Product>(task, goal), {.blind = blind});
      const task::SearchOutcome outcome = search.Next();
      return outcome.found() ? outcome.skeleton->cost : -1.0;
    };
    const auto regions = GroundLayout(layout);
    const auto poses =
        Task::Ground(symbolic::ParseProblem(planning::PoseProblemText(layout, 3), "problem",
                                            symbolic::ParseDomain(planning::PoseDomainText(), "domain")));
    const double expected = cost(regions, true);
    solved += expected > 0;
    EXPECT_EQ(cost(regions, false), expected) << text;
    if (one_each) {
      EXPECT_EQ(cost(poses, false), expected) << text;
    }
  }
  EXPECT_GT(solved, 10);
}

TEST(RegionLayoutTest, ReachableStatesAreCountedExactly) {
  planning::RegionLayout layout;
  layout.hub = "hub";
  layout.regions = {{"a", 1}, {"b", 1}, {"c", 2}};
  layout.items = {{"x", "a"}, {"y", "b"}};
  const std::string formula = "F(in(x,b) & X F in(y,a)) & F in(x,c)";
  for (int poses : {1, 2, 3}) {
    const std::string problem = planning::PoseProblemText(layout, poses);
    auto task = Task::Ground(symbolic::ParseProblem(
        problem, "problem", symbolic::ParseDomain(planning::PoseDomainText(), "domain")));
    const task::TemporalGoal goal{ltl::ParseFormula(formula), ltl::Semantics::kCosafe, {}};
    task::Product product(task, goal);
    task::StateGraph graph(product, {.blind = true});
    while (graph.ExpandBeyondGoals()) {
    }
    EXPECT_EQ(CountReachable(planning::PoseDomainText(), problem, formula, 1'000'000), graph.states())
        << poses;
    EXPECT_GT(graph.states(), 100u);
  }
}

}  // namespace
}  // namespace tether::bench
