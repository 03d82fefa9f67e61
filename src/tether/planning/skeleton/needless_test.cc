// Which sequences of actions become candidates of a plan, and when planning ends.

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/planning/test_scene.h"
#include "tether/planning/plan/problem.h"
#include "tether/symbolic/pddl/pddl.h"

namespace tether::planning {
namespace {

using Eigen::Vector3d;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kDomain = R"((define (domain carry)
  (:requirements :strips :negative-preconditions :disjunctive-preconditions)
  (:predicates (held ?a) (free) (on ?a ?b) (seen ?a) (block ?a) (plate ?b) (aside ?a))
  (:action pick :parameters (?a) :precondition (and (free) (block ?a))
    :effect (and (held ?a) (not (free))))
  (:action place :parameters (?a ?b) :precondition (and (held ?a) (plate ?b))
    :effect (and (on ?a ?b) (free) (not (held ?a))))
  (:action look :parameters (?a) :precondition (and (free) (block ?a) (not (seen ?a)))
    :effect (seen ?a))))";

std::shared_ptr<const symbolic::Task> CarryTask(const std::string& objects, const std::string& init,
                                                const std::string& goal) {
  const std::string problem = "(define (problem p) (:domain carry) (:objects " + objects +
                              ") (:init (free) " + init + ") (:goal " + goal + "))";
  return symbolic::Task::Ground(
      symbolic::ParseProblem(problem, "problem", symbolic::ParseDomain(kDomain, "domain")));
}

class NeedlessTest : public ::testing::Test {
 protected:
  NeedlessTest() : problem_(ReachProblem()) {
    problem_.scene.objects.clear();
    problem_.constraints.clear();
    // A stop of the hand anywhere.
    ActionSchema look{"look", {"a"}, {{}}, {}};
    look.steps[0].control = "hand";
    look.steps[0].target = "a";
    problem_.actions.push_back(look);
    problem_.search.max_actions = 4;
  }
  void Add(const std::string& name, const Vector3d& size, const Vector3d& p, bool movable) {
    scene::Object object;
    object.name = name;
    object.shape = geometry::Shape(geometry::Box{size});
    object.parent = "world";
    object.X_ParentObject = math::Pose(p);
    if (movable) object.mass = 0.1;
    problem_.scene.objects.push_back(object);
  }
  void AddBlock(const std::string& name, double x, double y) {
    Add(name, {0.04, 0.04, 0.04}, {x, y, 0.02}, true);
  }
  void AddPlate(const std::string& name, double x, double y, double size = 0.1) {
    Add(name, {size, size, 0.02}, {x, y, 0.01}, false);
  }

  Problem problem_;
};

// Find pointless_actions_are_cheaper: a stop in between lowers the sum of squares.
TEST_F(NeedlessTest, PointlessActionsAreCheaper) {
  AddBlock("a", 0.5, 0.0);
  AddBlock("b", 0.5, 0.2);
  AddPlate("bin", 0.45, -0.3);
  const auto task = CarryTask("a b bin", "(block a) (block b) (plate bin)", "(on b bin)");
  for (const int threads : {1, 3}) {
    for (const std::optional<int> max_plans : {std::optional<int>(), std::optional<int>(0)}) {
      problem_.search.threads = threads;
      problem_.search.max_plans = max_plans;
      const PlanReport report = PlanTask(problem_, *task);
      ASSERT_EQ(report.candidates.size(), 1u);
      EXPECT_THAT(report.best()->plan.actions, ElementsAre("pick(b)", "place(b,bin)"));
      EXPECT_TRUE(report.complete) << report.message;
      EXPECT_GT(report.needless, 3);
    }
  }
}

// Find redundant_plan, its sibling: another block is moved for nothing, with a temporal goal.
TEST_F(NeedlessTest, RedundantPlan) {
  AddBlock("a", 0.45, 0.15);
  AddBlock("b", 0.60, 0.02);
  AddPlate("tray", 0.42, -0.2, 0.2);
  const auto task = CarryTask("a b tray", "(block a) (block b) (plate tray)", "(on a tray)");
  const PlanReport report = PlanTask(problem_, *task);
  ASSERT_EQ(report.candidates.size(), 1u);
  EXPECT_THAT(report.best()->plan.actions, ElementsAre("pick(a)", "place(a,tray)"));
  EXPECT_TRUE(report.complete);
}

// What obstructs the shorter sequence is moved, although the symbols see no need.
TEST_F(NeedlessTest, WhatMakesRoomIsNotNeedless) {
  AddBlock("a", 0.45, 0.15);
  // It covers all of the tray.
  Add("b", {0.09, 0.06, 0.04}, {0.45, -0.2, 0.04}, true);
  AddPlate("tray", 0.45, -0.2, 0.1);
  AddPlate("table", 0.6, 0.15, 0.16);
  const auto task =
      CarryTask("a b tray table", "(block a) (block b) (plate tray) (plate table)", "(on a tray)");
  const PlanReport report = PlanTask(problem_, *task);
  ASSERT_TRUE(report.ok()) << report.message;
  const std::vector<std::string> actions = report.best()->plan.actions;
  EXPECT_EQ(actions.size(), 4u);
  EXPECT_EQ(actions.front(), "pick(b)");
  // The shorter one was tried, and failed.
  EXPECT_TRUE(std::any_of(report.candidates.begin(), report.candidates.end(),
                          [](const auto& c) { return c.plan.actions.size() == 2 && !c.feasible(); }));
}

// Find sort8_endless: orders of independent actions are one candidate, and planning ends.
TEST_F(NeedlessTest, Sort8Endless) {
  AddPlate("left", 0.45, 0.4, 0.22);
  AddPlate("right", 0.45, -0.4, 0.22);
  std::string objects = "left right", init = "(plate left) (plate right)", goal = "(and";
  for (int i = 0; i < 5; ++i) {
    const std::string name = "u" + std::to_string(i);
    AddBlock(name, 0.36 + 0.085 * (i % 4), i < 4 ? -0.06 : 0.06);
    objects += " " + name;
    init += " (block " + name + ")";
    goal += " (on " + name + (i % 2 == 0 ? " left)" : " right)");
  }
  problem_.search.max_actions = 10;
  const auto task = CarryTask(objects, init, goal + ")");
  for (const std::optional<int> max_plans : {std::optional<int>(), std::optional<int>(1)}) {
    problem_.search.max_plans = max_plans;
    const PlanReport report = PlanTask(problem_, *task);
    ASSERT_TRUE(report.ok()) << report.message;
    // The first order, and one that seems to be shorter.
    EXPECT_LE(report.candidates.size(), 2u);
    EXPECT_EQ(static_cast<int>(report.candidates.size()) + report.other_orders, 120);
    EXPECT_FALSE(report.complete);
    EXPECT_THAT(report.message, HasSubstr("other orders of actions that don't depend on each other"));
    EXPECT_THAT(report.message, HasSubstr("--max-plans 0"));
  }
}

TEST_F(NeedlessTest, ExplicitlyAllPlansAreAllOrders) {
  AddPlate("left", 0.45, 0.3, 0.2);
  AddBlock("a", 0.4, -0.1);
  AddBlock("b", 0.5, -0.1);
  const auto task =
      CarryTask("left a b", "(plate left) (block a) (block b)", "(and (on a left) (on b left))");
  problem_.search.max_plans = 0;
  const PlanReport report = PlanTask(problem_, *task);
  EXPECT_EQ(report.candidates.size(), 2u);
  EXPECT_TRUE(report.complete);
}

/// Many plates for one block: as many candidates, of growing cost.
class AnytimeTest : public NeedlessTest {
 protected:
  AnytimeTest() {
    AddBlock("a", 0.5, -0.1);
    objects_ = "a";
    for (int i = 0; i < 24; ++i) {
      const std::string name = "p" + std::to_string(i);
      AddPlate(name, 0.35 + 0.05 * (i % 6), 0.05 + 0.08 * (i / 6), 0.045);
      objects_ += " " + name;
      init_ += " (plate " + name + ")";
      goal_ += " (on a " + name + ")";
    }
    problem_.search.max_actions = 2;
  }
  PlanReport Plan() { return PlanTask(problem_, *CarryTask(objects_, init_, goal_ + ")")); }
  /// The number of the last candidate that improved on the best cost before it.
  static size_t LastImprovement(const PlanReport& report) {
    size_t last = 0;
    double best = 1e9;
    for (size_t i = 0; i < report.candidates.size(); ++i) {
      const CandidateReport& c = report.candidates[i];
      if (!c.feasible() || c.plan.cost >= best * (1 - 1e-6)) continue;
      best = c.plan.cost;
      last = i + 1;
    }
    return last;
  }

  std::string objects_, init_ = "(block a)", goal_ = "(or";
};

TEST_F(AnytimeTest, EndsWhereItNoLongerImproves) {
  problem_.search.min_candidates = 4;
  const PlanReport report = Plan();
  ASSERT_TRUE(report.ok());
  ASSERT_LT(report.candidates.size(), 24u);
  EXPECT_EQ(report.candidates.size(), std::max<size_t>(4, 2 * LastImprovement(report)));
  EXPECT_FALSE(report.complete);
  EXPECT_THAT(report.message, HasSubstr("min_candidates and patience"));
  EXPECT_THAT(report.message, HasSubstr("--max-plans 0"));
  problem_.search.patience = 1000;
  EXPECT_EQ(Plan().candidates.size(), 24u);
  EXPECT_TRUE(Plan().complete);
}

TEST_F(AnytimeTest, EndsAtTheSameCandidateAtAnyNumberOfThreads) {
  problem_.search.min_candidates = 4;
  for (const std::optional<int> max_plans : {std::optional<int>(), std::optional<int>(2)}) {
    problem_.search.max_plans = max_plans;
    problem_.search.threads = 1;
    const PlanReport one = Plan();
    problem_.search.threads = 5;
    const PlanReport five = Plan();
    ASSERT_EQ(one.candidates.size(), five.candidates.size());
    for (size_t i = 0; i < one.candidates.size(); ++i) {
      EXPECT_EQ(one.candidates[i].plan.actions, five.candidates[i].plan.actions);
      EXPECT_EQ(one.candidates[i].status, five.candidates[i].status);
      EXPECT_EQ(one.candidates[i].plan.cost, five.candidates[i].plan.cost);
    }
  }
}

TEST_F(AnytimeTest, AllAreListedWhenAskedFor) {
  problem_.search.min_candidates = 4;
  problem_.search.max_plans = 0;
  const PlanReport report = Plan();
  EXPECT_EQ(report.candidates.size(), 24u);
  EXPECT_TRUE(report.complete);
}

// With lengths in place of squares, a stop never lowers the cost.
TEST_F(NeedlessTest, LengthsDoNotProfitFromStops) {
  AddBlock("b", 0.5, 0.2);
  AddPlate("bin", 0.45, -0.3);
  const auto cost = [&](Objective objective, const std::string& goal) {
    problem_.program.objective = objective;
    const PlanReport report = PlanTask(problem_, *CarryTask("b bin", "(block b) (plate bin)", goal));
    EXPECT_TRUE(report.ok()) << report.message;
    return report.best()->plan.cost;
  };
  const std::string plain = "(on b bin)", stop = "(and (on b bin) (seen b))";
  EXPECT_LT(cost(Objective::kSquares, stop), 0.95 * cost(Objective::kSquares, plain));
  EXPECT_GT(cost(Objective::kLength, stop), cost(Objective::kLength, plain) * (1 - 1e-3));
}

}  // namespace
}  // namespace tether::planning
