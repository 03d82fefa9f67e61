// Several objects on one support: their places are found together. Find bin6.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/planning/check/checker.h"
#include "tether/scenario/generators/generate.h"
#include "tether/scenario/problem.h"

namespace tether::scenario {
namespace {

constexpr const char* kDomain = R"((define (domain own)
  (:requirements :strips :typing :equality :negative-preconditions :universal-preconditions)
  (:types support - object block - support)
  (:predicates (inhand ?x - block) (on ?x - block ?y - support))
  (:action pick :parameters (?x - block)
    :precondition (forall (?y - block) (and (not (inhand ?y)) (not (on ?y ?x))))
    :effect (and (inhand ?x) (forall (?y - support) (not (on ?x ?y)))))
  (:action place :parameters (?x - block ?y - support)
    :precondition (and (inhand ?x) (not (= ?x ?y)))
    :effect (and (on ?x ?y) (not (inhand ?x)))))
)";

/// `count` blocks that go into a bin of 24 cm inside; its walls, 8 cm high, are parts of it or objects.
Scenario Bin(int count, bool walls_are_objects) {
  GeneratedScenario texts;
  texts.domain = kDomain;
  const auto wall = [&](int i) {
    static const char* const sizes[] = {"[0.26, 0.01, 0.08]", "[0.26, 0.01, 0.08]", "[0.01, 0.24, 0.08]",
                                        "[0.01, 0.24, 0.08]"};
    static const char* const places[] = {"[0, 0.125, 0.05]", "[0, -0.125, 0.05]", "[0.125, 0, 0.05]",
                                         "[-0.125, 0, 0.05]"};
    return std::pair(std::string(sizes[i]), std::string(places[i]));
  };
  std::string objects, names, init, goal;
  for (int i = 0; i < 4; ++i) {
    const auto [size, place] = wall(i);
    objects += walls_are_objects ? "  wall" + std::to_string(i) + ": {shape: {box: " + size +
                                       "}, pose: {parent: bin, position: " + place + "}}\n"
                                 : "    - {box: " + size + ", pose: {position: " + place + "}}\n";
  }
  for (int i = 0; i < count; ++i) {
    const std::string name = "u" + std::to_string(i);
    objects += "  " + name + ": {shape: {box: [0.045, 0.045, 0.05]}, mass: 0.1, pose: {position: [" +
               std::to_string(0.36 + 0.12 * (i % 3)) + ", " + (i < 3 ? "0.05" : "0.2") +
               ", 0.025], rpy: [0, 0, " + std::to_string(0.3 * i) + "]}}\n";
    names += " " + name;
    init += " (on " + name + " table)";
    goal += " (on " + name + " bin)";
  }
  texts.scenario = R"(format: tether.scenario/1
title: bin
robots: {arm: {model: panda}}
objects:
  table: {shape: {box: [0.6, 1.1, 0.3]}, pose: {position: [0.52, 0, -0.15]}}
  bin:
    pose: {position: [0.45, -0.28, 0]}
    shape:
    - {box: [0.26, 0.26, 0.01], pose: {position: [0, 0, 0.005]}}
)" + objects + "task: {domain: domain.pddl, problem: problem.pddl, max_actions: " +
                   std::to_string(2 * count) + "}\nactions: [manipulation]\nplanning: {max_plans: 1}\n";
  texts.problem = "(define (problem p) (:domain own) (:objects table bin - support" + names +
                  " - block) (:init" + init + ") (:goal (and" + goal + ")))";
  return LoadGenerated(texts);
}

planning::PlanReport Plan(const Scenario& scenario) {
  PlanningOverrides overrides;
  overrides.threads = 1;
  return planning::PlanTask(MakeProblem(scenario, scenario.scene, overrides), *MakeTask(scenario));
}

void ExpectPlanned(const Scenario& scenario, const std::string& what) {
  const planning::PlanReport report = Plan(scenario);
  ASSERT_TRUE(report.ok()) << what << ": " << report.message;
  // One of the first orders, not one among a hundred.
  EXPECT_LE(report.candidates.size(), 6u) << what;
  const planning::Problem problem = MakeProblem(scenario, scenario.scene, {});
  EXPECT_TRUE(planning::CheckPlan(problem, report.best()->plan).Feasible(problem.program)) << what;
}

TEST(PackingTest, Bin6) { ExpectPlanned(Bin(6, false), "bin6"); }

TEST(PackingTest, WallsThatAreObjectsToo) { ExpectPlanned(Bin(6, true), "walls"); }

TEST(PackingTest, GeneratedBins) {
  for (const uint64_t seed : {2, 4, 5})
    ExpectPlanned(LoadGenerated(Generate("bin", {}, seed)), "seed " + std::to_string(seed));
}

}  // namespace
}  // namespace tether::scenario
