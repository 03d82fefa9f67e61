#include "tether/planning/modes/cost_bound.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/planning/test_scene.h"
#include "tether/common/random.h"
#include "tether/planning/plan/problem.h"
#include "tether/symbolic/pddl/pddl.h"

namespace tether::planning {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr const char* kDomain = R"((define (domain carry)
  (:requirements :strips :negative-preconditions :disjunctive-preconditions)
  (:predicates (held ?a) (free) (on ?a ?b) (place_for ?b))
  (:action pick :parameters (?a) :precondition (free) :effect (and (held ?a) (not (free))))
  (:action place :parameters (?a ?b) :precondition (and (held ?a) (place_for ?b))
    :effect (and (on ?a ?b) (free) (not (held ?a))))))";
constexpr const char* kGoal = R"((define (problem anywhere) (:domain carry)
  (:objects block near middling far)
  (:init (free) (place_for near) (place_for middling) (place_for far))
  (:goal (or (on block near) (on block middling) (on block far)))))";

/// A block, and three plates at growing distances from it.
Problem CarryProblem(double near, double middling, double far) {
  Problem problem = ReachProblem();
  problem.scene.objects.clear();
  const auto add = [&](const std::string& name, const Vector3d& size, const Vector3d& p, bool movable) {
    scene::Object object;
    object.name = name;
    object.shape = geometry::Shape(geometry::Box{size});
    object.parent = "world";
    object.X_ParentObject = math::Pose(p);
    if (movable) object.mass = 0.1;
    problem.scene.objects.push_back(object);
  };
  add("block", {0.04, 0.04, 0.04}, {0.45, -0.3, 0.02}, true);
  add("near", {0.1, 0.1, 0.02}, {0.45, -0.3 + near, 0.01}, false);
  add("middling", {0.1, 0.1, 0.02}, {0.45, -0.3 + middling, 0.01}, false);
  add("far", {0.1, 0.1, 0.02}, {0.45, -0.3 + far, 0.01}, false);
  problem.constraints.clear();
  problem.program.backend = nlp::Backend::kNative;
  problem.search.max_actions = 2;
  return problem;
}

std::shared_ptr<const symbolic::Task> CarryTask() {
  return symbolic::Task::Ground(
      symbolic::ParseProblem(kGoal, "problem", symbolic::ParseDomain(kDomain, "domain")));
}

TEST(CostBoundTest, NoPlanCostsLess) {
  Random random(5);
  for (int trial = 0; trial < 20; ++trial) {
    Problem problem =
        CarryProblem(random.Uniform(0.2, 0.25), random.Uniform(0.35, 0.45), random.Uniform(0.55, 0.7));
    problem.program.home = trial % 2 == 0;
    const SceneFacts facts(problem);
    for (const CandidateReport& candidate : PlanTask(problem, *CarryTask()).candidates) {
      ASSERT_TRUE(candidate.feasible()) << candidate.reason;
      const double bound = LowerCostBound(facts, BindSkeleton(problem, candidate.plan.actions));
      EXPECT_LE(bound, candidate.plan.cost);
      // It is of use: more than a third of what it bounds.
      EXPECT_GT(bound, 0.3 * candidate.plan.cost);
    }
  }
}

TEST(PlannerTest, WhatCanNotBeAmongTheBestIsPruned) {
  Problem problem = CarryProblem(0.12, 0.35, 0.65);
  const PlanReport all = PlanTask(problem, *CarryTask());
  ASSERT_EQ(all.candidates.size(), 3u);
  for (const int threads : {1, 3}) {
    problem.search.threads = threads;
    problem.search.max_plans = 1;
    const PlanReport best = PlanTask(problem, *CarryTask());
    EXPECT_TRUE(best.complete);
    EXPECT_EQ(best.best()->plan.cost, all.best()->plan.cost);
    ASSERT_EQ(best.candidates.size(), 3u);
    const auto pruned = std::count_if(best.candidates.begin(), best.candidates.end(), [&](const auto& c) {
      if (c.status != CandidateStatus::kPruned) return false;
      EXPECT_GE(c.bound, all.best()->plan.cost);
      EXPECT_THAT(c.reason, HasSubstr("it costs at least"));
      return true;
    });
    EXPECT_GE(pruned, 1);
    problem.search.max_plans = 2;
    const PlanReport two = PlanTask(problem, *CarryTask());
    EXPECT_EQ(two.candidates[two.BestFirst()[1]].plan.cost, all.candidates[all.BestFirst()[1]].plan.cost);
  }
}

TEST(PlannerTest, OnlyWhatCostsMoreIsPrunedHoweverNearItIs) {
  // Places of about the same distance: bounds lie a little below the best cost, or a little above.
  Random random(11);
  int pruned = 0, near = 0;
  for (int trial = 0; trial < 30; ++trial) {
    const double first = random.Uniform(0.12, 0.2), second = first + random.Uniform(0.11, 0.15);
    Problem problem = CarryProblem(first, second, second + random.Uniform(0.11, 0.2));
    problem.search.max_plans = 1 + trial % 2;
    const PlanReport report = PlanTask(problem, *CarryTask());
    std::vector<double> costs;
    for (const CandidateReport& candidate : report.candidates) {
      if (candidate.feasible()) costs.push_back(candidate.plan.cost);
    }
    std::sort(costs.begin(), costs.end());
    const auto wanted = static_cast<size_t>(*problem.search.max_plans);
    ASSERT_GE(costs.size(), wanted);
    for (const CandidateReport& candidate : report.candidates) {
      if (candidate.status == CandidateStatus::kPruned) {
        ++pruned;
        EXPECT_GE(candidate.bound, costs[wanted - 1]) << trial;
      } else if (candidate.bound > costs[wanted - 1] - 0.05) {
        ++near;
      }
    }
  }
  EXPECT_GE(pruned, 5);
  EXPECT_GE(near, 5) << "compared, though its bound was hardly below the best cost";
}

TEST(PlannerTest, WhatBlocksACandidateIsNamed) {
  Problem problem = CarryProblem(0.12, 0.35, 0.65);
  // Beyond the arm's reach: no pose will do, but by so little that nothing proves it.
  problem.scene.objects[1].X_ParentObject.p = Vector3d(0.845, 0, 0.01);
  problem.scene.objects[2].X_ParentObject.p = Vector3d(0.79, 0.3, 0.01);
  problem.scene.objects[3].X_ParentObject.p = Vector3d(0.6, 0.6, 0.01);
  const PlanReport report = PlanTask(problem, *CarryTask());
  EXPECT_EQ(report.status, PlanStatus::kGaveUp);
  for (const CandidateReport& candidate : report.candidates) {
    EXPECT_EQ(candidate.status, CandidateStatus::kGaveUp);
    EXPECT_THAT(candidate.blocking, ::testing::Contains(HasSubstr("reach"))) << candidate.reason;
    EXPECT_THAT(candidate.blocking, ::testing::Contains(HasSubstr("place(block,"))) << candidate.reason;
  }
}

TEST(PlannerTest, AProofOfFirstActionsSkipsTheirContinuations) {
  Problem problem = CarryProblem(0.12, 0.35, 0.65);
  // The block can't be had; there are many things to do after picking it.
  problem.scene.objects[0].X_ParentObject.p = Vector3d(1.5, 0, 0.02);
  problem.search.max_actions = 4;
  const PlanReport report = PlanTask(problem, *CarryTask());
  EXPECT_EQ(report.status, PlanStatus::kImpossible);  // Nothing else moves it.
  const auto begins_with_it = [](const CandidateReport& c) {
    return c.plan.actions.front() == "pick(block)";
  };
  EXPECT_EQ(std::count_if(report.candidates.begin(), report.candidates.end(), begins_with_it), 1);
}

TEST(PlannerTest, WhatWasGivenUpIsNeitherProvedNorAll) {
  Problem problem = CarryProblem(0.12, 0.35, 0.65);
  problem.search.max_actions = 0;
  const auto task = symbolic::Task::Ground(symbolic::ParseProblem(
      "(define (problem have) (:domain fetch) (:objects block) (:init (free)) (:goal (held block)))",
      "problem",
      symbolic::ParseDomain("(define (domain fetch) (:predicates (held ?a) (free))"
                            " (:action pick :parameters (?a) :precondition (free) :effect (held ?a)))",
                            "domain")));
  // From where the block can be had to where it is proved that it can't: between them nothing is proved, and
  // there is nothing else to do.
  int given_up = 0, proved = 0;
  for (double x = 0.75; x < 1; x += 0.005) {
    problem.scene.objects[0].X_ParentObject.p = Vector3d(x, 0, 0.02);
    const PlanReport report = PlanTask(problem, *task);
    ASSERT_EQ(report.candidates.size(), 1u);
    const CandidateStatus status = report.candidates[0].status;
    if (status == CandidateStatus::kInfeasible) {
      ++proved;
      EXPECT_EQ(report.status, PlanStatus::kImpossible) << x;
      EXPECT_TRUE(report.complete) << x;
    }
    if (status != CandidateStatus::kGaveUp) continue;
    ++given_up;
    EXPECT_EQ(report.status, PlanStatus::kGaveUp) << x << ": " << report.message;
    EXPECT_FALSE(report.complete) << x << ": what begins like it was not looked at";
    EXPECT_THAT(report.message, HasSubstr("no candidate has feasible key poses")) << x;
  }
  EXPECT_GE(given_up, 1);
  EXPECT_GE(proved, 1);
}

}  // namespace
}  // namespace tether::planning
