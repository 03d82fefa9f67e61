// Long: finds about wrong results of planning (docs/finds.md), a scene of its kind for each, and siblings.
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/scenario/test_scenarios.h"
#include "tether/constraints/core/kind.h"
#include "tether/planning/check/checker.h"
#include "tether/planning/plan/problem.h"
#include "tether/planning/skeleton/action_reader.h"
#include "tether/scenario/problem.h"

namespace tether::scenario {
namespace {

using planning::PlanReport;
using planning::PlanStatus;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kDomain = R"((define (domain own)
  (:requirements :strips :typing :negative-preconditions :equality)
  (:types thing)
  (:predicates (inhand ?a - thing) (free) (on ?a ?b - thing) (tool ?a - thing) (pressed ?a - thing)
    (pulled ?a - thing) (pusher ?a - thing))
  (:action pick :parameters (?a - thing) :precondition (and (free) (tool ?a)) :effect (and (inhand ?a) (not (free))))
  (:action place :parameters (?a ?b - thing) :precondition (and (inhand ?a) (not (= ?a ?b)))
    :effect (and (on ?a ?b) (free) (not (inhand ?a))))
  (:action push :parameters (?a ?b ?c - thing) :precondition (and (inhand ?a) (pusher ?a) (not (= ?a ?b)) (on ?b ?c))
    :effect (pulled ?b))
  (:action press :parameters (?a ?b - thing) :precondition (and (inhand ?a) (not (= ?a ?b))) :effect (pressed ?b))))";

struct Texts {
  std::string scenario, domain, problem;
};

/// Objects beside a table in front of a Panda. `movable`: names of those that can be picked.
struct Scene {
  std::string things;
  std::string fixed, movable;
  std::string goal;
  int max_actions = 4;
  std::string robot = "{model: panda}";
  std::string table = "[3.0, 1.6, 0.5]";
  std::string init = "";
};

Scenario Load(const Scene& scene) {
  Texts texts;
  texts.scenario =
      "format: tether.scenario/1\ntitle: find\nseed: 1\nrobots:\n  panda: " + scene.robot +
      "\nobjects:\n  table:\n    shape: {box: " + scene.table + "}\n    pose: {position: [0.9, 0, -0.25]}" +
      scene.things + "\ntask:\n  domain: domain.pddl\n  problem: problem.pddl\n  max_actions: " +
      std::to_string(scene.max_actions) + "\nactions: [manipulation]\nplanning: {max_plans: 1}\n";
  texts.domain = kDomain;
  std::string init = "(free) " + scene.init, names = scene.movable + " ";
  for (size_t begin = 0; begin < scene.movable.size();) {
    const size_t end = names.find(' ', begin);
    const std::string name = names.substr(begin, end - begin);
    init += " (tool " + name + ") (on " + name + " table)";
    begin = end + 1;
  }
  texts.problem = "(define (problem find) (:domain own) (:objects table " + scene.fixed + " " +
                  scene.movable + " - thing) (:init " + init + ") (:goal " + scene.goal + "))";
  return LoadScenario(
      "scenario.yaml",
      {{"scenario.yaml", texts.scenario}, {"domain.pddl", texts.domain}, {"problem.pddl", texts.problem}});
}

PlanReport Plan(const Scene& scene) {
  const Scenario scenario = Load(scene);
  PlanningOverrides overrides;
  overrides.threads = 1;
  return planning::PlanTask(MakeProblem(scenario, scenario.scene, overrides), *MakeTask(scenario));
}

std::string Thing(const std::string& name, const std::string& shape, const std::string& pose,
                  const std::string& more = "") {
  return "\n  " + name + ":\n    shape: " + shape + "\n    pose: " + pose + more;
}

const std::string kMass = "\n    mass: 0.1";

/// A hook of two lying capsules like a T: four lowest points, coplanar but for how π was written.
std::string THook(const std::string& quarter) {
  return Thing("hook",
               "[{capsule: {radius: 0.01, length: 0.3}, pose: {position: [-0.09, 0, 0], rpy: [0, " + quarter +
                   ", 0]}}, {capsule: {radius: 0.01, length: 0.16}, pose: {position: [0.06, 0, 0], rpy: [" +
                   quarter + ", 0, 0]}}]",
               "{position: [0.4, 0.3, 0.01]}", kMass);
}

TEST(PlanningFinds, THookHasNoLowerFace) {
  double cost = 0;
  for (const std::string quarter : {"1.5707963267948966", "1.570796", "1.5708", "1.571"}) {
    Scene scene;
    scene.things = THook(quarter) + Thing("tray", "{box: [0.4, 0.3, 0.02]}", "{position: [0.5, -0.3, 0.01]}");
    scene.fixed = "tray";
    scene.movable = "hook";
    scene.goal = "(on hook tray)";
    const PlanReport report = Plan(scene);
    ASSERT_TRUE(report.ok()) << quarter << ": " << report.message;
    if (cost == 0) cost = report.best()->plan.cost;
    EXPECT_NEAR(report.best()->plan.cost, cost, 0.01 * cost) << quarter;
  }
}

/// A sibling: boards whose tops differ by what rounding to 0.1 mm makes of them are one table.
TEST(PlanningFinds, BoardsRoundedToTenthsOfAMillimetreAreOneFace) {
  Scene scene;
  scene.things = Thing("bench",
                       "[{box: [0.2, 0.1, 0.0401], pose: {position: [0, 0.05, 0.02005]}}, "
                       "{box: [0.2, 0.1, 0.04], pose: {position: [0, -0.05, 0.02]}}]",
                       "{position: [0.5, -0.3, 0]}") +
                 Thing("a", "{box: [0.05, 0.15, 0.05]}", "{position: [0.5, 0.2, 0.025]}", kMass);
  scene.fixed = "bench";
  scene.movable = "a";
  scene.goal = "(on a bench)";
  const PlanReport report = Plan(scene);
  EXPECT_TRUE(report.ok()) << report.message;
}

TEST(PlanningFinds, LyingCylinderAndSphereProvedImpossible) {
  for (const std::string shape : {"{cylinder: {radius: 0.02, length: 0.08}}", "{sphere: 0.02}",
                                  "{capsule: {radius: 0.02, length: 0.08}}"}) {
    Scene scene;
    scene.things = Thing("b", shape, "{position: [0.5, 0.2, 0.02], rpy: [1.5708, 0, 0]}", kMass) +
                   Thing("a", "{box: [0.06, 0.06, 0.06]}", "{position: [0.5, 0, 0.03]}");
    scene.fixed = "a";
    scene.movable = "b";
    scene.goal = "(on b a)";
    const PlanReport report = Plan(scene);
    EXPECT_EQ(report.status, PlanStatus::kGaveUp) << shape;
    EXPECT_THAT(report.message,
                AllOf(HasSubstr("not modelled: b has no flat lower face"), HasSubstr("round")));
  }
}

TEST(PlanningFinds, TiltedImpossible) {
  Scene scene;
  scene.things =
      Thing("ramp", "{box: [0.25, 0.25, 0.04]}", "{position: [0.45, -0.28, 0.06], rpy: [0, 0.17, 0]}") +
      Thing("a", "{box: [0.05, 0.05, 0.05]}", "{position: [0.5, 0.1, 0.025]}", kMass);
  scene.fixed = "ramp";
  scene.movable = "a";
  scene.goal = "(on a ramp)";
  PlanReport report = Plan(scene);
  EXPECT_EQ(report.status, PlanStatus::kGaveUp);
  EXPECT_THAT(report.message,
              HasSubstr("not modelled: ramp has no flat upper face: it is tilted by 10 degrees"));

  scene.things =
      Thing("ramp", "{box: [0.25, 0.25, 0.04]}", "{position: [0.45, -0.28, 0.06], rpy: [0.3, 0, 0]}") +
      Thing("a", "{box: [0.05, 0.05, 0.05]}", "{parent: ramp, position: [0, 0, 0.045]}", kMass);
  scene.goal = "(and (free) (pressed table) (on a table) (not (inhand a)))";
  scene.goal = "(on a ramp)";
  report = Plan(scene);
  EXPECT_EQ(report.status, PlanStatus::kGaveUp);
  EXPECT_THAT(report.message, HasSubstr("not modelled"));
}

TEST(PlanningFinds, RefutedButExit4) {
  Scene scene;
  scene.things = Thing("a", "{box: [0.045, 0.045, 0.045]}", "{position: [0.5, 0, 0.0225]}", kMass) +
                 Thing("b", "{box: [0.045, 0.045, 0.045]}", "{position: [0.95, 0.1, 0.0225]}", kMass);
  scene.movable = "a b";
  scene.goal = "(on b a)";
  for (const int max_actions : {2, 6, 20}) {
    scene.max_actions = max_actions;
    const PlanReport report = Plan(scene);
    EXPECT_EQ(report.status, PlanStatus::kImpossible) << max_actions << report.message;
    EXPECT_TRUE(report.complete);
    EXPECT_THAT(report.message, AllOf(HasSubstr("pick(b)"), HasSubstr("beyond reach")));
  }
  // A sibling: too wide, wherever it is.
  scene.things =
      Thing("a", "{box: [0.045, 0.045, 0.045]}", "{position: [0.5, 0, 0.0225]}", kMass) +
      Thing("b", "{cylinder: {radius: 0.05, length: 0.045}}", "{position: [0.5, 0.2, 0.0225]}", kMass);
  const PlanReport wide = Plan(scene);
  EXPECT_EQ(wide.status, PlanStatus::kImpossible) << wide.message;
  EXPECT_THAT(wide.message, HasSubstr("b is 10.0 cm wide"));
}

/// No proof: what a hook could bring nearer is given up, not refuted.
TEST(PlanningFinds, WhatSomethingElseCouldMoveIsNotRefuted) {
  Scene scene;
  scene.things =
      Thing("b", "{box: [0.05, 0.05, 0.05]}", "{position: [0.95, 0.1, 0.025]}", kMass) + THook("1.5708");
  scene.movable = "b hook";
  scene.init = "(pusher hook)";
  scene.goal = "(inhand b)";
  scene.max_actions = 2;
  const PlanReport report = Plan(scene);
  EXPECT_EQ(report.status, PlanStatus::kGaveUp) << report.message;
}

TEST(PlanningFinds, TouchAlone) {
  const std::string stick = Thing("stick", "{capsule: {radius: 0.0125, length: 0.28}}",
                                  "{position: [0.45, 0.25, 0.0125], rpy: [0, 1.5708, 0]}", kMass);
  for (const std::string button :
       {"{box: [0.05, 0.05, 0.06]}", "{cylinder: {radius: 0.03, length: 0.06}}", "{sphere: 0.03}"}) {
    for (const std::string& tool : std::vector<std::string>{stick, THook("1.5708")}) {
      Scene scene;
      scene.things = tool + Thing("button", button, "{position: [0.6, 0, 0.03]}");
      scene.fixed = "button";
      scene.movable = tool == stick ? "stick" : "hook";
      scene.goal = "(pressed button)";
      scene.max_actions = 2;
      const PlanReport report = Plan(scene);
      EXPECT_TRUE(report.ok()) << button << ": " << report.message;
    }
  }
}

TEST(PlanningFinds, MessagesNameTheCause) {
  const auto lift = [](const std::string& shape, const std::string& position, const std::string& more) {
    Scene scene;
    scene.things = Thing("tray", "{box: [0.2, 0.2, 0.02]}", "{position: [0.4, -0.35, 0.01]}") +
                   Thing("a", shape, "{position: " + position + "}", more);
    scene.fixed = "tray";
    scene.movable = "a";
    scene.goal = "(on a tray)";
    scene.max_actions = 2;
    return scene;
  };
  EXPECT_THAT(Plan(lift("{box: [0.085, 0.054, 0.001]}", "[0.5, 0.1, 0.0005]", kMass)).message,
              AllOf(HasSubstr("a is too low to grasp: it is 1.0 mm high"), HasSubstr("pads")));
  EXPECT_THAT(Plan(lift("{box: [0.05, 0.05, 0.05]}", "[0.5, 0.1, 0.025]", "\n    mass: 3")).message,
              AllOf(HasSubstr("a is too heavy for the grip: it weighs 3.00 kg"), HasSubstr("20 N")));
  EXPECT_THAT(Plan(lift("{box: [0.05, 0.05, 0.05]}", "[0.5, 0.1, 0.025]", "\n    mass: 0.1\n    friction: 0"))
                  .message,
              HasSubstr("hold 0.00 kg of what has a friction of 0.00"));
  // Two numbers that differ are not written alike.
  EXPECT_THAT(Plan(lift("{box: [0.0753, 0.0753, 0.05]}", "[0.5, 0.1, 0.025]", kMass)).message,
              HasSubstr("a is 7.53 cm wide where it is narrowest; the gripper grasps up to 7.50 cm"));
  Scene base = lift("{box: [0.05, 0.05, 0.05]}", "[0.5, 0.1, 0.025]", kMass);
  base.robot = "{model: panda, pose: {position: [0.4, 0, -0.05]}}";
  const PlanReport near = Plan(base);
  EXPECT_FALSE(near.ok());
  EXPECT_THAT(near.message, HasSubstr("too near to the base of panda"));
}

/// Planning refutes what the executive would not grasp, with the same reason.
TEST(PlanningFinds, PlanAndRunDisagreeOnGraspability) {
  const auto plan = [](const std::string& shape, const std::string& more = "") {
    Texts texts;
    texts.scenario = R"(format: tether.scenario/1
title: can
seed: 1
robots:
  jaco: {model: j2n6s300, q: [0.207, -0.062, 1.881, 0.378, -1.385, -1.592]}
objects:
  table: {shape: {box: [1.4, 1.8, 0.04]}, pose: {position: [0, 0, -0.02]}}
  can: {shape: )" + shape +
                     ", mass: 0.1" + more + R"(, pose: {parent: left, position: [0, 0, 0.05]}}
regions:
  left: {disc: 0.08, capacity: 1, pose: {position: [0.3, 0.3, 0]}}
  right: {disc: 0.08, capacity: 1, pose: {position: [0.3, -0.3, 0]}}
  hub: {sphere: 0.05, hub: true, pose: {position: [0.3, 0, 0.35]}}
task: {goal: 'F in(can,right)'}
actions: [regions]
)";
    const Scenario scenario = LoadScenario("scenario.yaml", {{"scenario.yaml", texts.scenario}});
    PlanningOverrides overrides;
    overrides.threads = 1;
    return planning::PlanTask(MakeProblem(scenario, scenario.scene, overrides), *MakeTask(scenario));
  };
  EXPECT_TRUE(plan("{cylinder: {radius: 0.02, length: 0.1}}").ok());
  EXPECT_TRUE(plan("{box: [0.09, 0.03, 0.1]}").ok());  // too wide in one direction only
  for (const std::string shape :
       {"{cylinder: {radius: 0.045, length: 0.1}}", "{box: [0.09, 0.09, 0.1]}", "{sphere: 0.05}"}) {
    const PlanReport report = plan(shape);
    EXPECT_EQ(report.status, PlanStatus::kImpossible) << shape << report.message;
    EXPECT_THAT(report.message, HasSubstr("'can' can't be grasped from above: can is "));
  }
  EXPECT_THAT(plan("{box: [0.09, 0.03, 0.1]}", ", friction: 0").message, HasSubstr("too heavy for the grip"));
}

/// A find of `shelf_roof`: a part with a name is a frame; what does not fit beneath the roof has no plan
/// there.
TEST(PlanningFinds, ShelfRoofNamesItsBoard) {
  for (const double roof : {0.81, 0.15}) {
    const std::string shelf = Thing("shelf",
                                    "[{box: [0.22, 0.4, 0.02], pose: {position: [0, 0, 0.01]}, name: board}, "
                                    "{box: [0.22, 0.4, 0.02], pose: {position: [0, 0, " +
                                        std::to_string(roof) + "]}}]",
                                    "{position: [0.62, 0.0, 0]}");
    Scene scene;
    scene.things = shelf + Thing("a", "{cylinder: {radius: 0.025, length: 0.2}}",
                                 "{position: [0.4, -0.35, 0.1]}", kMass);
    scene.fixed = "shelf board";
    scene.movable = "a";
    scene.goal = "(on a board)";
    scene.max_actions = 2;
    const PlanReport report = Plan(scene);
    if (roof < 0.2) {
      EXPECT_FALSE(report.ok());
      continue;
    }
    ASSERT_TRUE(report.ok()) << report.message;
    const planning::PlanStep& last = report.best()->plan.steps.back();
    EXPECT_EQ(last.target, "board");
    EXPECT_NEAR(last.X_TC.p.z(), 0.11, 1e-3) << "on the board, in its frame";
  }
}

/// A find of `shelf_roof`: a can that does not fit under the roof goes on it, a low box may go inside.
TEST(PlanningFinds, ShelfRoofTooLow) {
  const std::string shelf = Thing("shelf",
                                  "[{box: [0.22, 0.4, 0.02], pose: {position: [0, 0, 0.01]}}, "
                                  "{box: [0.22, 0.1, 0.02], pose: {position: [0, 0.15, 0.81]}}, "
                                  "{box: [0.02, 0.4, 0.78], pose: {position: [0.10, 0, 0.41]}}]",
                                  "{position: [0.62, 0.0, 0]}");
  Scene scene;
  scene.things =
      shelf + Thing("a", "{cylinder: {radius: 0.025, length: 0.1}}", "{position: [0.4, -0.35, 0.05]}", kMass);
  scene.fixed = "shelf";
  scene.movable = "a";
  scene.goal = "(on a shelf)";
  scene.max_actions = 2;
  const PlanReport report = Plan(scene);
  // The top is out of reach, the board below is not.
  ASSERT_TRUE(report.ok()) << report.message;
  EXPECT_LT(report.best()->plan.steps.back().X_TC.p.z(), 0.1);
  EXPECT_EQ(report.best()->plan.steps.back().face, "part 1 of shelf");
}

/// `ob` on a stand of these parts, planned.
PlanReport PlanOnParts(const std::string& parts, const std::string& ob_size, const std::string& ob_height) {
  Scene scene;
  scene.things = Thing("stand", parts, "{position: [0.5, -0.25, 0.035]}") +
                 Thing("ob", "{box: " + ob_size + "}", "{position: [0.5, 0.2, " + ob_height + "]}", kMass);
  scene.fixed = "stand";
  scene.movable = "ob";
  scene.goal = "(on ob stand)";
  scene.max_actions = 2;
  return Plan(scene);
}

constexpr const char* kTwoBars =
    "[{box: [0.2, 0.02, 0.07], pose: {position: [0, 0.09, 0]}}, "
    "{box: [0.2, 0.02, 0.07], pose: {position: [0, -0.09, 0]}}]";

/// Four walls without a floor: what is put there stands on one of them, not over the hole.
TEST(PlanningFinds, RingIsNoFace) {
  const PlanReport report = PlanOnParts(
      "[{box: [0.24, 0.01, 0.07], pose: {position: [0, 0.115, 0]}}, "
      "{box: [0.24, 0.01, 0.07], pose: {position: [0, -0.115, 0]}}, "
      "{box: [0.01, 0.22, 0.07], pose: {position: [0.115, 0, 0]}}, "
      "{box: [0.01, 0.22, 0.07], pose: {position: [-0.115, 0, 0]}}]",
      "[0.05, 0.05, 0.05]", "0.025");
  ASSERT_TRUE(report.ok()) << report.message;
  const planning::PlanStep& last = report.best()->plan.steps.back();
  EXPECT_THAT(last.face, HasSubstr("part "));
  EXPECT_GE(last.X_TC.p.head<2>().cwiseAbs().maxCoeff(), 0.11);
}

TEST(PlanningFinds, BetweenTwoBarsIsNoFace) {
  const PlanReport report = PlanOnParts(kTwoBars, "[0.05, 0.05, 0.05]", "0.025");
  ASSERT_TRUE(report.ok()) << report.message;
  const planning::PlanStep& last = report.best()->plan.steps.back();
  EXPECT_GE(std::abs(last.X_TC.p.y()), 0.08);
  EXPECT_LE(std::abs(last.X_TC.p.y()), 0.1);
  // Edges of sheets are no faces: only an object that spans both could stand there.
  const PlanReport sheets = PlanOnParts(
      "[{box: [0.2, 0.0018, 0.07], pose: {position: [0, 0.09, 0]}}, "
      "{box: [0.2, 0.0018, 0.07], pose: {position: [0, -0.09, 0]}}]",
      "[0.05, 0.05, 0.05]", "0.025");
  EXPECT_EQ(sheets.status, PlanStatus::kGaveUp) << sheets.message;
}

/// Neither sheet is a face by itself; a board that is long enough spans both.
TEST(PlanningFinds, LongBoardBridgesTwoSheets) {
  const PlanReport report = PlanOnParts(
      "[{box: [0.2, 0.0018, 0.07], pose: {position: [0, 0.09, 0]}}, "
      "{box: [0.2, 0.0018, 0.07], pose: {position: [0, -0.09, 0]}}]",
      "[0.05, 0.34, 0.03]", "0.015");
  ASSERT_TRUE(report.ok()) << report.message;
  EXPECT_LT(std::abs(report.best()->plan.steps.back().X_TC.p.y()), 0.08);
}

/// An object on a movable board moves along with it, whatever frame its pose was written in.
TEST(PlanningFinds, WhatIsCarriedComesAlongWithoutParent) {
  Scene scene;
  scene.things = Thing("stand", "{box: [0.2, 0.2, 0.07]}", "{position: [0.45, -0.3, 0.035]}") +
                 Thing("tray", "{box: [0.5, 0.06, 0.03]}", "{position: [0.68, 0.1, 0.015]}", kMass) +
                 Thing("ob", "{box: [0.04, 0.04, 0.04]}", "{position: [0.88, 0.1, 0.05]}", kMass);
  scene.fixed = "stand";
  scene.movable = "tray ob";
  scene.goal = "(on ob stand)";
  const PlanReport report = Plan(scene);
  ASSERT_TRUE(report.ok()) << report.message;
  EXPECT_EQ(report.best()->plan.actions.front(), "pick(tray)");
}

/// Every registered kind by itself, in an action of one step: a plan, or a reason that names the cause.
/// A box far beyond what the hook reaches: the direction of a push that never begins is not the cause.
TEST(PlanningFinds, WhatTheHookDoesNotReachIsSaid) {
  for (const double x : {0.62, 0.80, 0.95}) {
    Scenario scenario = Shipped("workspace_reach");
    for (scene::Object& object : scenario.scene.objects) {
      if (object.name == "box") object.X_ParentObject.p.x() = x;
    }
    PlanningOverrides overrides;
    overrides.threads = 1;
    const PlanReport report =
        planning::PlanTask(MakeProblem(scenario, scenario.scene, overrides), *MakeTask(scenario));
    EXPECT_FALSE(report.ok()) << x;
    EXPECT_THAT(report.message, AllOf(HasSubstr("hook does not get to box to push it: it would be "),
                                      Not(HasSubstr("slip off"))))
        << x;
  }
}

/// An action of one step in which the hand does this to `a`.
std::pair<planning::Problem, PlanReport> PlanOneStep(const std::string& shape, const std::string& position,
                                                     const std::string& constraint) {
  Scene scene;
  scene.things = Thing("a", shape, "{position: " + position + "}", kMass);
  scene.movable = "a";
  scene.goal = "(inhand a)";
  scene.max_actions = 1;
  Scenario scenario = Load(scene);
  const std::string text =
      "format: tether.actions/1\npick:\n  parameters: [x]\n  steps:\n  - control: hand\n    target: a\n"
      "    constraints:\n    - " +
      constraint + "\n    allow: [[hand, a]]\n    execute:\n    - gripper: {close_on: a}\n";
  Diagnostics diagnostics;
  scenario.actions = planning::ParseActions(ParseYaml(text, "one.yaml"), {}, diagnostics);
  diagnostics.ThrowIfAny();
  PlanningOverrides overrides;
  overrides.threads = 1;
  planning::Problem problem = MakeProblem(scenario, scenario.scene, overrides);
  PlanReport report = planning::PlanTask(problem, *MakeTask(scenario));
  return {std::move(problem), std::move(report)};
}

/// `graspable` by itself: what is grasped is between the fingers, of a bar and of what is round.
TEST(PlanningFinds, GraspableAloneCentresTheGrasp) {
  const std::vector<std::pair<std::string, Eigen::Vector3d>> shapes{
      {"{box: [0.12, 0.03, 0.04]}", {0.06, 0.015, 0.02}},
      {"{box: [0.03, 0.12, 0.04]}", {0.015, 0.06, 0.02}},
      {"{cylinder: {radius: 0.02, length: 0.04}}", {0.02, 0.02, 0.02}}};
  for (const auto& [shape, half] : shapes) {
    const auto [problem, report] = PlanOneStep(shape, "[0.6, 0.3, 0.02]", "graspable: {object: a}");
    ASSERT_TRUE(report.ok()) << shape << ": " << report.message;
    planning::Plan plan = report.best()->plan;
    const Eigen::Vector3d p = plan.steps[0].X_TC.p;
    for (int axis = 0; axis < 3; ++axis) EXPECT_LE(std::abs(p[axis]), half[axis] + 1e-3) << shape << axis;
    // The checker sees it too.
    plan.steps[0].X_TC.p +=
        2.5 * half.maxCoeff() * (half.x() > half.y() ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY());
    plan.steps[0].q.resize(0);
    std::string causes;
    for (const planning::CheckFinding& finding : planning::CheckPlan(problem, plan).findings)
      causes += finding.cause + "; ";
    EXPECT_THAT(causes, HasSubstr("mm beside a;")) << shape;
  }
}

TEST(PlanningFinds, EveryKindWorksOnItsOwn) {
  const std::map<std::string, std::pair<std::string, std::string>> steps{
      {"graspable", {"hand in a", "graspable: {object: a}"}},
      {"inside", {"hand in a", "inside: {frame: hand, of: a, margin: 0.01}"}},
      {"push_normal", {"a in table", "push_normal: {tool: hand, object: a, on: table}"}},
      {"rests_on", {"a in table", "rests_on: {object: a, on: table}"}},
      {"slide", {"a in table", "slide: {object: a, on: table}"}},
      {"supported", {"a in table", "supported: {object: a, by: table}"}},
      {"touch", {"hand in a", "touch: {between: [hand, a]}"}}};
  for (const constraints::Kind& kind : constraints::Registry()) {
    ASSERT_TRUE(steps.contains(kind.name)) << "a new kind needs an action of one step here";
    Scene scene;
    scene.things = Thing("a", "{box: [0.05, 0.05, 0.05]}", "{position: [0.5, 0.1, 0.025]}", kMass);
    scene.movable = "a";
    scene.goal = "(inhand a)";
    scene.max_actions = 1;
    Scenario scenario = Load(scene);
    const auto& [frames, constraint] = steps.at(kind.name);
    const std::string control = frames.substr(0, frames.find(" in ")),
                      target = frames.substr(frames.find(" in ") + 4);
    const std::string text =
        "format: tether.actions/1\npick:\n  parameters: [x]\n  steps:\n  - control: " + control +
        "\n    target: " + target + "\n    constraints:\n    - " + constraint +
        "\n    allow: [[hand, a]]\n    execute:\n    - reach: {speed: 0.1}\n";
    Diagnostics diagnostics;
    scenario.actions = planning::ParseActions(ParseYaml(text, "one.yaml"), {}, diagnostics);
    PlanningOverrides overrides;
    overrides.threads = 1;
    const planning::Problem problem = MakeProblem(scenario, scenario.scene, overrides);
    const PlanReport report = planning::PlanTask(problem, *MakeTask(scenario));
    if (kind.name == "push_normal" && !report.ok()) {
      // The pusher has to touch before: none does.
      EXPECT_THAT(report.message, HasSubstr("push_normal(hand, a)"));
      continue;
    }
    ASSERT_TRUE(report.ok()) << kind.name << ": " << report.message;
    EXPECT_TRUE(planning::CheckPlan(problem, report.best()->plan).Feasible(problem.program)) << kind.name;
  }
}

}  // namespace
}  // namespace tether::scenario
