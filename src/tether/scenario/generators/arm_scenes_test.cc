// Scenes that PDDL allows and the arm does not, and one in which only the arm knows that a tool is needed.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/planning/check/checker.h"
#include "tether/planning/plan/problem.h"
#include "tether/scenario/generators/generate.h"
#include "tether/scenario/problem.h"

namespace tether::scenario {
namespace {

using planning::PlanReport;
using planning::PlanStatus;
using testing::AllOf;
using testing::HasSubstr;
using testing::MatchesRegex;

// Nothing in it is about the hand's reach.
constexpr const char* kDomain = R"((define (domain arm)
  (:requirements :strips :typing :negative-preconditions :equality)
  (:types thing)
  (:predicates (inhand ?a - thing) (free) (on ?a ?b - thing) (can_move ?a - thing) (tool ?a - thing)
    (near ?a - thing) (pulled ?a - thing))
  (:action pick :parameters (?a - thing) :precondition (and (free) (can_move ?a))
    :effect (and (inhand ?a) (not (free))))
  (:action place :parameters (?a ?b - thing) :precondition (and (inhand ?a) (not (can_move ?b)))
    :effect (and (on ?a ?b) (free) (not (inhand ?a))))
  (:action push :parameters (?a ?b ?c - thing)
    :precondition (and (inhand ?a) (tool ?a) (can_move ?b) (not (= ?a ?b)) (on ?b ?c) (not (pulled ?b)))
    :effect (pulled ?b))))";

constexpr const char* kHook = R"(
  hook:
    mass: 0.1
    pose: {parent: table, position: [0, 0.3, 0.26]}
    shape:
    - capsule: {radius: 0.01, length: 0.25}
      pose: {position: [-0.09, 0.05, 0], rpy: [0, 1.5708, 0]}
    - capsule: {radius: 0.01, length: 0.10}
      pose: {position: [0.035, 0, 0], rpy: [1.5708, 0, 0]})";

/// `things`: more objects, beside a table in front of a Panda. `task`: more keys of the task.
Scenario Load(const std::string& things, const std::string& objects, const std::string& init,
              const std::string& goal, int max_actions, const std::string& task = "",
              const std::string& domain = kDomain) {
  GeneratedScenario texts;
  texts.scenario = R"(format: tether.scenario/1
title: arm
seed: 1
robots:
  panda: {model: panda}
objects:
  table:
    shape: {box: [3.0, 1.6, 0.5]}
    pose: {position: [0.9, 0, -0.25]})" +
                   things + R"(
task:
  domain: domain.pddl
  problem: problem.pddl
  max_actions: )" + std::to_string(max_actions) +
                   task + "\nactions: [manipulation]\n";
  texts.domain = domain;
  texts.problem = "(define (problem arm) (:domain arm) (:objects table " + objects +
                  " - thing) (:init (free) " + init + ") (:goal " + goal + "))";
  return LoadGenerated(texts);
}

std::string Block(const std::string& name, const std::string& size, const std::string& position,
                  bool movable = true) {
  return "\n  " + name + ":\n    shape: {box: " + size + "}\n    pose: {position: " + position + "}" +
         (movable ? "\n    mass: 0.1" : "");
}

PlanReport Plan(const Scenario& scenario) {
  PlanningOverrides overrides;
  overrides.threads = 1;
  return planning::PlanTask(MakeProblem(scenario, scenario.scene, overrides), *MakeTask(scenario));
}

TEST(ArmScenesTest, ABoxBeyondReachWithoutAToolIsImpossible) {
  const PlanReport report = Plan(Load(Block("box", "[0.05, 0.05, 0.05]", "[1.0, 0, 0.025]"), "box",
                                      "(can_move box) (on box table)", "(inhand box)", 3));
  EXPECT_EQ(report.status, PlanStatus::kImpossible);
  EXPECT_THAT(report.message, MatchesRegex(".*pick\\(box\\): [0-9.]+ cm beyond reach"));
}

TEST(ArmScenesTest, ABoxBeyondTheHooksReachEndsWithoutAPlan) {
  const PlanReport report = Plan(
      Load(Block("box", "[0.05, 0.05, 0.05]", "[1.6, 0, 0.025]") + kHook, "box hook",
           "(can_move box) (can_move hook) (tool hook) (on box table) (on hook table)", "(inhand box)", 4));
  EXPECT_TRUE(report.status == PlanStatus::kImpossible || report.status == PlanStatus::kGaveUp);
  EXPECT_THAT(report.message, HasSubstr("beyond reach"));
}

TEST(ArmScenesTest, AShelfTooHighIsImpossible) {
  const PlanReport report = Plan(Load(Block("box", "[0.05, 0.05, 0.05]", "[0.5, 0.2, 0.025]") +
                                          Block("shelf", "[0.3, 0.3, 0.02]", "[0.5, -0.2, 1.1]", false),
                                      "box shelf", "(can_move box) (on box table)", "(on box shelf)", 3));
  EXPECT_NE(report.status, PlanStatus::kSolved);
  EXPECT_THAT(report.message, MatchesRegex(".*place\\(box,shelf\\): [0-9.]+ cm beyond reach"));
}

TEST(ArmScenesTest, ABlockTooWideIsImpossible) {
  const PlanReport report = Plan(Load(Block("box", "[0.1, 0.1, 0.05]", "[0.5, 0.2, 0.025]"), "box",
                                      "(can_move box) (on box table)", "(inhand box)", 3));
  EXPECT_EQ(report.status, PlanStatus::kImpossible);
  EXPECT_THAT(report.message,
              HasSubstr("box is 10.0 cm wide where it is narrowest; the gripper grasps up to 7.5 cm"));
}

TEST(ArmScenesTest, ATargetUnderAnOverhangIsTold) {
  const PlanReport report = Plan(Load(Block("box", "[0.05, 0.05, 0.05]", "[0.5, 0, 0.025]") +
                                          Block("roof", "[0.6, 0.6, 0.02]", "[0.5, 0, 0.25]", false),
                                      "box roof", "(can_move box) (on box table)", "(inhand box)", 3));
  EXPECT_EQ(report.status, PlanStatus::kGaveUp);
  EXPECT_THAT(report.message, AllOf(HasSubstr("pick(box)"), HasSubstr("roof")));
}

TEST(WithinReachTest, MistakesAreExplained) {
  const auto error = [](const std::string& init, const std::string& key) -> std::string {
    try {
      Load(Block("box", "[0.05, 0.05, 0.05]", "[0.5, 0, 0.025]"), "box", init, "(inhand box)", 3, key);
    } catch (const InputError& problem) {
      return problem.what();
    }
    return "";
  };
  EXPECT_THAT(error("(can_move box)", "\n  within_reach: [nearr]"),
              AllOf(HasSubstr("'within_reach' names 'nearr'"), HasSubstr("did you mean 'near'?")));
  EXPECT_THAT(error("(near box)", "\n  within_reach: [near]"),
              AllOf(HasSubstr(":init states 'near'"), HasSubstr("one of the two")));
}

// By the symbols the box can be picked at once; it is beyond the arm's reach without the hook.
TEST(ArmScenesTest, TheHookIsFoundWithoutBeingAskedFor) {
  const Scenario scenario =
      Load(Block("box", "[0.05, 0.05, 0.05]", "[0.9, 0, 0.025]") +
               Block("shelf", "[0.3, 0.3, 0.1]", "[0.35, -0.35, 0.05]", false) + kHook,
           "box hook shelf", "(can_move box) (can_move hook) (tool hook) (on box table) (on hook table)",
           "(and (on box shelf) (free))", 5);
  const PlanReport report = Plan(scenario);
  ASSERT_EQ(report.status, PlanStatus::kSolved) << report.message;
  const planning::Plan& plan = report.best()->plan;
  EXPECT_THAT(plan.actions,
              testing::ElementsAre("pick(hook)", "push(hook,box,table)", testing::StartsWith("place(hook,"),
                                   "pick(box)", "place(box,shelf)"));
  const planning::Problem problem = MakeProblem(scenario, scenario.scene, {});
  EXPECT_TRUE(planning::CheckPlan(problem, plan).Feasible(problem.program));
}

// To the symbols a push changes nothing at all.
TEST(ArmScenesTest, TheHookIsFoundThoughThePushHasNoEffect) {
  std::string domain = kDomain;
  domain.replace(domain.find(":effect (pulled ?b)"), 19, ":effect (on ?b ?c)");
  const Scenario scenario =
      Load(Block("box", "[0.05, 0.05, 0.05]", "[0.9, 0, 0.025]") +
               Block("shelf", "[0.3, 0.3, 0.1]", "[0.35, -0.35, 0.05]", false) + kHook,
           "box hook shelf", "(can_move box) (can_move hook) (tool hook) (on box table) (on hook table)",
           "(and (on box shelf) (free))", 5, "", domain);
  const PlanReport report = Plan(scenario);
  ASSERT_EQ(report.status, PlanStatus::kSolved) << report.message;
  EXPECT_THAT(report.best()->plan.actions, testing::Contains("push(hook,box,table)"));
}

TEST(WithinReachTest, PredicatesComeFromTheArm) {
  const Scenario scenario =
      Load(Block("box", "[0.05, 0.05, 0.05]", "[0.9, 0, 0.025]") +
               Block("shelf", "[0.3, 0.3, 0.1]", "[0.35, -0.35, 0.05]", false) +
               Block("attic", "[0.3, 0.3, 0.02]", "[0.5, -0.2, 1.3]", false) + kHook,
           "box hook shelf attic", "(can_move box) (can_move hook) (on box table) (on hook table)",
           "(inhand box)", 3, "\n  within_reach: [near]");
  const int near = scenario.problem->domain->FindPredicate("near");
  std::vector<std::string> names;
  for (const symbolic::Fact& fact : scenario.problem->init) {
    if (fact.predicate == near) names.push_back(scenario.problem->objects[fact.arguments[0]].name);
  }
  EXPECT_THAT(names, testing::UnorderedElementsAre("table", "hook", "shelf"));
}

}  // namespace
}  // namespace tether::scenario
