#include <unistd.h>

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/tether/cli_testing.h"
#include "testing/common/needs_plugin.h"
#include "tether/common/document/value.h"
#include "tether/common/exit_code.h"

namespace tether {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(CliTest, HelpHasExamplesForEveryCommand) {
  for (const std::string command :
       {"", "plan", "run", "check", "bench", "generate", "campaign", "automaton", "task"}) {
    const Outcome outcome = Tether(command + " --help");
    EXPECT_EQ(outcome.exit_code, 0) << command;
    EXPECT_THAT(outcome.out, HasSubstr("Examples:")) << command;
  }
}

TEST(CliTest, VersionIsSaid) {
  const Outcome outcome = Tether("--version");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.out, ::testing::StartsWith("tether "));
}

TEST(CliTest, WrongUseIsExitCode2) {
  for (const std::string arguments :
       {"", "plna", "plan", "plan x --frobnicate", "plan x --seed abc", "bench nothing"}) {
    const Outcome outcome = Tether(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_FALSE(outcome.err.empty()) << arguments;
  }
  EXPECT_THAT(Tether("bench tabel1").err, HasSubstr("unknown benchmark 'tabel1' (did you mean 'table1'?"));
  EXPECT_THAT(Tether("bench motion").err, HasSubstr("benchmark 'motion' needs problems (--problems DIR"));
  EXPECT_THAT(Tether("bench geometry --problems x").err,
              HasSubstr("--problems has no effect on benchmark 'geometry'"));
}

TEST(CliTest, BadInputIsExitCode2WithOneLinePerMistake) {
  const Outcome missing = Tether("plan no_such.yaml --json -");
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_EQ(missing.out, "");
  EXPECT_THAT(missing.err, HasSubstr("no_such.yaml: cannot read this file"));

  const ScratchFolder folder;
  const std::string file = folder.File("tether_cli_bad.yaml");
  WriteFile(file, "format: tether.scenario/1\ntitel: x\nobjects: {a: {shape: {bx: [1, 1, 1]}}}\n");
  for (const std::string command : {"plan", "run", "check"}) {
    const Outcome bad = Tether(command + " '" + file + "'");
    EXPECT_EQ(bad.exit_code, 2) << command;
    EXPECT_THAT(bad.err, HasSubstr("tether_cli_bad.yaml:2:1: unknown key 'titel'"));
    EXPECT_THAT(bad.err, HasSubstr("tether_cli_bad.yaml:3:23: unknown shape 'bx'"));
  }
  EXPECT_THAT(Tether("plan " + Scenario("stacking") + " --solver ipotp").err, HasSubstr("ipotp"));
  EXPECT_EQ(Tether("plan " + Scenario("stacking") + " --threads -1").exit_code, 2);
}

TEST(CliTest, WhatCannotBeWrittenIsSaidBeforeTheWork) {
  const ScratchFolder folder;
  const Outcome plan = Tether("plan " + Scenario("hanoi") +
                              " --json /no/such/a --output /no/such/b --trace " + folder.path().string());
  EXPECT_EQ(plan.exit_code, 2);
  EXPECT_EQ(plan.out, "");
  EXPECT_THAT(plan.err, HasSubstr("--json: cannot write /no/such/a: its folder: No such file or directory (a "
                                  "path in a writable folder)"));
  EXPECT_THAT(plan.err, HasSubstr("--output: cannot write /no/such/b"));
  EXPECT_THAT(plan.err, HasSubstr("it is a folder"));
  const Outcome run = Tether("run " + Scenario("hanoi") + " --snapshots /dev/null/pictures");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(run.out, "");
  EXPECT_THAT(run.err, HasSubstr("--snapshots: cannot write to folder /dev/null/pictures"));
}

TEST(CliTest, NumbersOutOfRangeAreBadInput) {
  const Outcome seed = Tether("plan " + Scenario("stacking") + " --seed -4");
  EXPECT_EQ(seed.exit_code, 2);
  EXPECT_THAT(seed.err,
              HasSubstr("--seed: '-4' (a whole number from 0 to 18446744073709551615 is accepted)"));
  EXPECT_EQ(Tether("run " + Scenario("stacking") + " --seed -4").exit_code, 2);
  const Outcome candidate = Tether("run " + Scenario("stacking") + " --candidate 0");
  EXPECT_EQ(candidate.exit_code, 2);
  EXPECT_EQ(candidate.out, "");
  EXPECT_THAT(candidate.err, HasSubstr("--candidate is 0 (1 or more: 1 is the best)"));
}

TEST(CliTest, LimitsEndPlanningHoweverShortTheyAre) {
  // Times so short that they end planning at different places.
  for (const char* limit : {"1e-9", "1e-4", "2e-3", "4e-3", "6e-3"}) {
    const Outcome outcome = Tether("plan " + Scenario("hanoi") + " --time-limit " + limit + " --json -");
    EXPECT_TRUE(outcome.exit_code == 4 || outcome.exit_code == 0) << limit << ": " << outcome.err;
  }
  const Outcome none = Tether("plan " + Scenario("hanoi") + " --max-iterations 0");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("--max-iterations is too small (a whole number above zero"));
}

TEST(CliTest, WhatCannotHoldTogetherIsNamedByEverySolver) {
  // The shelf stands where the arm does not reach, by so little that nothing proves it.
  std::string text = ReadFile(kSource + "/scenarios/workspace_reach.yaml");
  const auto replace = [&](const std::string& from, const std::string& to) {
    ASSERT_NE(text.find(from), std::string::npos) << from;
    for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
      text.replace(at, from.size(), to);
  };
  replace("[0.35, -0.35, 0.05]", "[0.84, -0.53, 0.05]");
  replace(": workspace_reach/", ": " + kSource + "/scenarios/workspace_reach/");
  const ScratchFolder folder;
  const std::string file = folder.File("tether_cli_far.yaml");
  WriteFile(file, text);
  for (const char* solver : {"native", "ipopt", "nlopt"}) {
    if (solver != std::string("native") && !HasPlugin(solver)) continue;
    const Outcome outcome =
        Tether("plan '" + file + "' --threads 1 --time-limit 1.5 --json - --solver " + solver);
    EXPECT_EQ(outcome.exit_code, 4) << solver;
    EXPECT_THAT(outcome.out, HasSubstr("\"blocking\"")) << solver;
    EXPECT_THAT(outcome.out, HasSubstr("reach(panda)")) << solver;
  }
}

TEST(CliTest, ATemporalGoalNeedsADomain) {
  const ScratchFolder folder;
  const std::string file = folder.File("tether_cli_ltl.yaml");
  WriteFile(file,
            "format: tether.scenario/1\nobjects: {a: {shape: {sphere: 1}}}\ntask: {goal: {ltl: F(x)}}\n");
  const Outcome outcome = Tether("plan '" + file + "'");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err,
              HasSubstr("tether_cli_ltl.yaml:3:20: a temporal goal without a domain ('domain' and "
                        "'problem' beside 'goal', or a scene with regions)"));
}

TEST(CliTest, ATemporalGoalTakesThePlaceOfTheScenarios) {
  const auto best_cost = [](const std::string& options) {
    const Outcome outcome = Tether("plan " + Scenario("stacking") + " --max-plans 1 --json - " + options);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return ParseYaml(outcome.out, "stdout").Find("plans")->items().at(0).Find("cost")->number();
  };
  EXPECT_NEAR(best_cost("--goal 'F(on(blue,amber) & on(coral,blue) & on(denim,coral))'"), best_cost(""),
              1e-9);
  const Outcome wrong = Tether("plan " + Scenario("stacking") + " --goal 'F on(blue,ambre)' --search astra");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("--search: unknown 'astra' (did you mean 'astar'?"));
  EXPECT_THAT(
      Tether("plan " + Scenario("stacking") + " --goal 'F on(blue,ambre)'").err,
      HasSubstr("formula:1:3: unknown proposition 'on(blue,ambre)': there is no object 'ambre' (did you "
                "mean 'amber'?"));
  const Outcome never =
      Tether("plan " + Scenario("stacking") + " --goal 'F(on(blue,amber) & !on(blue,amber))'");
  EXPECT_EQ(never.exit_code, 3);
  EXPECT_THAT(never.out, HasSubstr("the formula is unsatisfiable"));
}

TEST(CliTest, AutomataAreForPeopleAndForTools) {
  const std::string formula = "'F(a & X F on(b,c))'";
  EXPECT_THAT(Tether("automaton " + formula).out, HasSubstr("3 states, 2 propositions"));
  EXPECT_THAT(Tether("automaton --hoa " + formula).out, ::testing::StartsWith("HOA: v1\n"));
  EXPECT_THAT(Tether("automaton --dot " + formula).out, ::testing::StartsWith("digraph automaton {\n"));
  const Outcome json = Tether("automaton --json - " + formula);
  EXPECT_EQ(json.exit_code, 0);
  const Value value = ParseYaml(json.out, "standard output");
  EXPECT_EQ(value.Find("format")->AsText(), "tether.automaton/1");
  EXPECT_EQ(value.Find("states")->integer(), 3);
  EXPECT_EQ(value.Find("accepting")->items().size(), 1u);
  EXPECT_EQ(value.Find("edges")->items().size(), 5u);
}

TEST(CliTest, WrongFormulasAreExitCode2AndImpossibleOnes3) {
  const Outcome wrong = Tether("automaton 'F(a & )'");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("formula:1:7: unexpected ')'"));
  const Outcome safe = Tether("automaton 'F a & G !b'");
  EXPECT_EQ(safe.exit_code, 2);
  EXPECT_THAT(safe.err, HasSubstr("formula:1:7: the formula is not co-safe: 'G' requires"));
  EXPECT_EQ(Tether("automaton 'F a & G !b' --semantics ltlf").exit_code, 0);
  EXPECT_THAT(Tether("automaton a --semantics ltl").err, HasSubstr("did you mean 'ltlf'?"));
  EXPECT_THAT(Tether("automaton 'F(a & X F b)' --semantics ltlf").err, HasSubstr("formula:1:7: X is weak"));
  const Outcome impossible = Tether("automaton 'F a & G !a' --semantics ltlf");
  EXPECT_EQ(impossible.exit_code, 3);
  EXPECT_THAT(impossible.err, HasSubstr("the formula cannot be satisfied"));
  EXPECT_EQ(Tether("automaton a --hoa --json -").exit_code, 2);
  EXPECT_EQ(Tether("automaton a --hoa --dot").exit_code, 2);
}

TEST(CliTest, TasksAreSearchedWithoutAScene) {
  const std::string hanoi =
      "task '" + kSource + "/scenarios/hanoi/domain.pddl' '" + kSource + "/scenarios/hanoi/problem.pddl'";
  const Outcome people = Tether(hanoi);
  EXPECT_EQ(people.exit_code, 0) << people.err;
  EXPECT_THAT(people.out, HasSubstr("cost 14"));
  for (const std::string search : {"astar", "greedy", "dijkstra", "bfs"}) {
    const Outcome outcome = Tether(hanoi + " --json - --search " + search);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const Value json = ParseYaml(outcome.out, "task.json");
    EXPECT_EQ(json.Find("format")->AsText(), "tether.task_report/1");
    EXPECT_EQ(json.Find("status")->AsText(), "solved");
    const Value& plan = json.Find("plans")->items().at(0);
    EXPECT_GE(plan.Find("actions")->items().size(), 14u);
    EXPECT_TRUE(search == "greedy" || plan.Find("cost")->number() == 14);
    const Value& effort = *json.Find("search");
    EXPECT_GT(effort.Find("expanded")->integer(), 0);
    EXPECT_EQ(effort.Find("reachable") != nullptr, search == "dijkstra" || search == "bfs");
    EXPECT_EQ(json.Find("automaton"), nullptr);
  }

  const Outcome temporal = Tether(hanoi + " --json - --goal 'F(inhand(box_2) & X F inhand(box_1))'");
  EXPECT_EQ(temporal.exit_code, 0) << temporal.err;
  EXPECT_EQ(ParseYaml(temporal.out, "task.json").Find("automaton")->Find("states")->integer(), 3);
  EXPECT_EQ(Tether(hanoi + " --goal 'F(inhand(box_1) & inhand(box_2))'").exit_code, 3);
  EXPECT_EQ(Tether(hanoi + " --goal 'F(inhand(box_1) & inhand(box_2))' --time-limit 1e-9").exit_code, 4);
  const Outcome unknown = Tether(hanoi + " --goal 'F inhand(bax_1)'");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err,
              HasSubstr("formula:1:3: unknown proposition 'inhand(bax_1)': there is no object 'bax_1' "
                        "(did you mean 'box_1'?"));
  EXPECT_THAT(Tether(hanoi + " --search astra").err, HasSubstr("did you mean 'astar'?"));
  EXPECT_EQ(Tether(hanoi + " --search greedy --max-plans 2").exit_code, 2);
}

// Find time_limit_grounding: no limit was checked before the search.
TEST(CliTest, TimeLimitGrounding_GroundingGivesUpAtItsLimits) {
  const ScratchFolder folder;
  std::string objects;
  for (int i = 0; i < 100; ++i) objects += " o" + std::to_string(i);
  WriteFile(folder.File("d.pddl"),
            "(define (domain d) (:predicates (p ?a ?b) (q))\n (:action huge :parameters (?a ?b ?c ?d ?e ?f)"
            " :precondition (p ?e ?f) :effect (p ?a ?b)))");
  WriteFile(folder.File("p.pddl"),
            "(define (problem x) (:domain d) (:objects" + objects + ") (:init (p o1 o2)) (:goal (q)))");
  const std::string task = "task '" + folder.File("d.pddl") + "' '" + folder.File("p.pddl") + "' --json - ";
  const auto message = [](const Outcome& outcome) {
    const Value json = ParseYaml(outcome.out, "task.json");
    EXPECT_EQ(json.Find("status")->AsText(), "gave_up");
    EXPECT_FALSE(json.Find("complete")->boolean());
    return json.Find("message")->AsText();
  };
  const Outcome time = Tether(task + "--time-limit 0.2");
  EXPECT_EQ(time.exit_code, 4) << time.err;
  EXPECT_EQ(message(time), "grounding: the time limit was reached");
  const Outcome memory = Tether(task + "--memory-limit 60M");
  EXPECT_EQ(memory.exit_code, 4) << memory.err;
  EXPECT_EQ(message(memory), "grounding: the memory limit was reached");
  const Outcome wrong = Tether(task + "--memory-limit lots");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("'lots' (a size is accepted, such as 512, 500M or 2.5G; 0: no limit)"));
  // The sibling: planning grounds too.
  EXPECT_EQ(Tether("plan " + Scenario("hanoi") + " --memory-limit 1M").exit_code, 4);
}

// Find json_huge.
TEST(CliTest, JsonHuge_AutomataAreSummedUp) {
  const std::string formula = "'F(a & X[!] F b) & F(c & X[!] F d)' --semantics ltlf";
  const Outcome summary = Tether("automaton --summary --json - " + formula);
  EXPECT_EQ(summary.exit_code, 0) << summary.err;
  const Value value = ParseYaml(summary.out, "automaton.json");
  EXPECT_EQ(value.Find("states")->integer(), 9);
  EXPECT_EQ(value.Find("accepting_states")->integer(), 1);
  EXPECT_EQ(value.Find("lost_states")->integer(), 0);
  EXPECT_EQ(value.Find("atoms")->items().size(), 4u);
  EXPECT_EQ(value.Find("edges"), nullptr);
  EXPECT_THAT(Tether("automaton --summary " + formula).out, HasSubstr("9 states, 4 propositions"));
  EXPECT_EQ(Tether("automaton --summary --hoa " + formula).exit_code, 2);
}

TEST(CliTest, BenchPlanningWritesJsonOnly) {
  const Outcome outcome = Tether("bench planning --solver native --repetitions 1 --scenario " +
                                 Scenario("tool_use") + " --json -");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const Value json = ParseYaml(outcome.out, "bench.json");
  EXPECT_EQ(json.Find("format")->AsText(), "tether.bench/1");
  EXPECT_EQ(json.Find("rows")->items().size(), 1u);
  const Value& problem = json.Find("problems")->items().at(0);
  EXPECT_EQ(problem.Find("exit_code")->AsText(), "0");
  EXPECT_GT(problem.Find("process_s")->Find("median")->number(), 0);
  EXPECT_THAT(outcome.err, HasSubstr("Tool Use"));

  EXPECT_EQ(Tether("bench planning --solver natvie").exit_code, 2);
  const Outcome geometry = Tether("bench geometry --repetitions 3");
  EXPECT_EQ(geometry.exit_code, 2);
  EXPECT_THAT(geometry.err, HasSubstr("--repetitions has no effect on benchmark 'geometry'"));
}

TEST(CliTest, ShippedFilesAreInOrder) {
  const Outcome outcome =
      Tether("check '" + kSource + "/models/actions/manipulation.yaml' " + Scenario("hanoi") + " " +
             Scenario("workspace_reach") + " " + Scenario("stacking") + " " + Scenario("tool_use"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  EXPECT_THAT(outcome.out, Not(HasSubstr("\x1b"))) << "colours belong on terminals only";
}

TEST(CliTest, ABadFileDoesNotHideTheOthersResults) {
  const Outcome outcome = Tether("check " + Scenario("hanoi") + " no_such.yaml " + Scenario("stacking"));
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.out, HasSubstr("hanoi.yaml: scenario, ok"));
  EXPECT_THAT(outcome.out, HasSubstr("stacking.yaml: scenario, ok"));
  EXPECT_THAT(outcome.err, HasSubstr("no_such.yaml: cannot read this file"));
}

TEST(CliTest, AProofIsExitCode3AndSaysWhy) {
  const ScratchFolder folder;
  const std::string start = folder.File("proof_");
  WriteFile(start + "problem.pddl",
            "(define (problem p) (:domain stacking) (:objects slab cube - block)"
            " (:init (on slab bench) (on cube bench)) (:goal (on slab cube)))");
  const std::string scenario = start + "scenario.yaml";
  WriteFile(scenario,
            "format: tether.scenario/1\nrobots: {arm: {model: panda}}\nobjects:\n"
            "  bench: {shape: {box: [0.8, 0.9, 0.1]}, pose: {position: [0.6, 0, -0.05]}}\n"
            "  slab: {shape: {box: [0.12, 0.11, 0.03]}, mass: 0.2, pose: {position: [0.5, 0.2, 0.015]}}\n"
            "  cube: {shape: {box: [0.06, 0.06, 0.06]}, mass: 0.2, pose: {position: [0.5, -0.2, 0.03]}}\n"
            "task: {domain: '" +
                kSource + "/scenarios/stacking/domain.pddl', problem: '" + start +
                "problem.pddl', max_actions: 40}\nactions: [manipulation]\n");
  const Outcome outcome = Tether("plan '" + scenario + "'");
  EXPECT_EQ(outcome.exit_code, 3) << outcome.out << outcome.err;
  EXPECT_THAT(outcome.out,
              HasSubstr("pick(slab): slab is 11.0 cm wide where it is narrowest; the gripper grasps up to"));
  EXPECT_EQ(Tether("plan '" + scenario + "' --max-actions 1").exit_code, 4) << "a depth limit proves nothing";
  const Outcome temporal = Tether("plan '" + scenario + "' --goal 'F on(slab,cube)'");
  EXPECT_EQ(temporal.exit_code, 3) << temporal.out << temporal.err;
  EXPECT_THAT(temporal.out, HasSubstr("slab is 11.0 cm wide"));
}

// What `run` refuses, `plan` says and `check` refuses: key poses of what nothing holds may well be feasible.
TEST(CliTest, WhatIsNotHeldIsSaidByPlanAndCheck) {
  const ScratchFolder folder;
  const std::string start = folder.File("unheld_");
  WriteFile(start + "domain.pddl",
            "(define (domain d) (:predicates (done ?a) (met ?a))"
            " (:action meet :parameters (?a) :effect (met ?a))"
            " (:action lay :parameters (?a ?b) :precondition (met ?a) :effect (done ?a)))");
  WriteFile(start + "problem.pddl",
            "(define (problem p) (:domain d) (:objects cube pad) (:init) (:goal (done cube)))");
  const auto actions = [](const std::string& verbs, const std::string& target) {
    return "format: tether.actions/1\nmeet:\n  parameters: [a]\n  steps:\n  - control: hand\n    target: " +
           target + "\n    constraints:\n    - " +
           (target == "a" ? "graspable: {object: a}" : "inside: {frame: hand, of: pad}") + "\n" +
           (target == "a" ? "    allow: [[hand, a]]\n" : "    allow: [[hand, pad]]\n") + verbs +
           "lay:\n  parameters: [a, b]\n  steps:\n  - control: a\n    target: b\n    constraints:\n"
           "    - rests_on: {object: a, on: b}\n    - supported: {object: a, by: b}\n";
  };
  const std::string scenario = start + "scenario.yaml";
  WriteFile(scenario,
            "format: tether.scenario/1\nrobots: {arm: {model: panda}}\nobjects:\n"
            "  bench: {shape: {box: [0.8, 0.9, 0.1]}, pose: {position: [0.6, 0, -0.05]}}\n"
            "  pad: {shape: {box: [0.2, 0.2, 0.04]}, pose: {position: [0.5, 0.2, 0.02]}}\n"
            "  cube: {shape: {box: [0.05, 0.05, 0.05]}, mass: 0.2, pose: {position: [0.5, -0.2, 0.025]}}\n"
            "task: {domain: '" +
                start + "domain.pddl', problem: '" + start +
                "problem.pddl', goal: {pddl: '(done cube)'}, "
                "max_actions: 2}\nactions: ['" +
                start + "actions.yaml']\n");
  const std::string plan = start + "plan.json";
  WriteFile(start + "actions.yaml", actions("    execute:\n    - gripper: {close_on: a}\n", "a"));
  const Outcome held = Tether("plan '" + scenario + "' --json - --output '" + plan + "'");
  EXPECT_EQ(held.exit_code, 0) << held.out << held.err;
  EXPECT_EQ(ParseYaml(held.out, "stdout").Find("not_runnable"), nullptr) << held.out;
  // Two siblings: nothing is held, or the hand is somewhere else.
  WriteFile(start + "actions.yaml", actions("", "pad"));
  const Outcome unheld = Tether("plan '" + scenario + "' --json - --output '" + plan + "'");
  EXPECT_EQ(unheld.exit_code, 0) << unheld.out << unheld.err;
  const std::string why = "'cube' is not held, and no step before brings 'hand' to it";
  EXPECT_THAT(unheld.err, HasSubstr("the best plan can't be run: "));
  EXPECT_THAT(unheld.err, HasSubstr(why));
  ASSERT_NE(ParseYaml(unheld.out, "stdout").Find("not_runnable"), nullptr);
  EXPECT_THAT(ParseYaml(unheld.out, "stdout").Find("not_runnable")->AsText(), HasSubstr(why));
  for (const std::string& command :
       std::vector<std::string>{"check '" + plan + "'", "run '" + scenario + "' --plan '" + plan + "'"}) {
    const Outcome refused = Tether(command);
    EXPECT_EQ(refused.exit_code, 2) << command;
    EXPECT_THAT(refused.err, HasSubstr(why)) << command;
  }
}

TEST(CliTest, ADepthLimitIsGivingUp) {
  const Outcome outcome = Tether("plan " + Scenario("workspace_reach") + " --max-actions 2 --json -");
  ASSERT_EQ(outcome.exit_code, 4) << outcome.err;
  const Value report = ParseYaml(outcome.out, "stdout");
  EXPECT_EQ(report.Find("status")->AsText(), "gave_up");
  EXPECT_TRUE(report.Find("plans")->items().empty());
}

TEST(CliTest, PlanJsonHasTheDocumentedShapeAndThePlanFileFits) {
  const ScratchFolder folder;
  const std::string plan = folder.File("plan.json");
  const Outcome outcome =
      Tether("plan " + Scenario("stacking") + " --max-plans 1 --json - --output '" + plan + "'");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Value report = ParseYaml(outcome.out, "stdout");
  // The best one of all: no other is left out.
  EXPECT_TRUE(report.Find("complete")->boolean());
  EXPECT_EQ(report.members()[0].key, "format");
  EXPECT_EQ(report.members()[1].key, "tether");
  EXPECT_EQ(report.members()[2].key, "seed");
  EXPECT_EQ(report.Find("status")->AsText(), "solved");
  const Value& best = report.Find("plans")->items().at(0);
  for (const char* key : {"status", "feasible", "actions", "cost", "max_violation_m", "max_violation_rad",
                          "optimize_s", "evaluations", "steps"}) {
    EXPECT_NE(best.Find(key), nullptr) << key;
  }
  EXPECT_LE(best.Find("max_violation_m")->number(), 1e-3);
  EXPECT_LE(best.Find("max_violation_rad")->number(), 5e-3);
  for (const char* key : {"action", "control", "target", "position", "quaternion_wxyz"}) {
    EXPECT_NE(best.Find("steps")->items().at(0).Find(key), nullptr) << key;
  }
  for (const char* key : {"parse_s", "search_s", "optimize_s", "total_s"}) {
    EXPECT_NE(report.Find("timing")->Find(key), nullptr) << key;
  }
  EXPECT_NE(report.Find("search")->Find("expanded"), nullptr);

  const Outcome check = Tether("check '" + plan + "'");
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
  const Outcome other = Tether("run " + Scenario("hanoi") + " --plan '" + plan + "'");
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("the plan was made for another scenario"));
}

TEST(CliTest, AnInterruptedPlanIsExitCode130) {
  TETHER_NEEDS_PLUGIN("nlopt");
  const Outcome outcome =
      Tether("plan " + Scenario("hanoi") + " --max-actions 30 --max-plans 0 --solver nlopt --json -",
             "timeout --preserve-status -s INT 2");
  ASSERT_EQ(outcome.exit_code, 130) << outcome.err;
  ASSERT_FALSE(outcome.out.empty()) << outcome.err;
  const Value report = ParseYaml(outcome.out, "stdout");
  EXPECT_EQ(report.Find("status")->AsText(), "interrupted");
  EXPECT_FALSE(report.Find("plans")->items().empty()) << "what was found so far is kept";
}

}  // namespace
}  // namespace tether
