// Facts that are irrelevant to the goal: tested here beside the searches that show it.

#include "tether/symbolic/grounding/relevance.h"

#include <string>

#include <gtest/gtest.h>

#include "testing/task/enumeration.h"
#include "tether/task/search/greedy.h"
#include "tether/task/search/skeleton.h"

namespace tether::task {
namespace {

using symbolic::KeepRelevant;
using symbolic::RelevantTask;
using symbolic::Task;

std::shared_ptr<const Task> Ground(const std::string& domain, const std::string& problem) {
  return Task::Ground(symbolic::ParseProblem(problem, "p", symbolic::ParseDomain(domain, "d")));
}

uint64_t Expansions(const std::shared_ptr<const Task>& task, double* cost) {
  SkeletonSearch search(task, {.blind = true, .first_at_once = true});
  const SearchOutcome outcome = search.Next();
  *cost = outcome.found() ? outcome.skeleton->cost : -1;
  return search.expanded();
}

// Find irrelevant_facts: switches that no one asks about double the states each.
TEST(RelevanceTest, IrrelevantFacts_StatesDontMultiply) {
  std::string switches, init;
  for (int i = 0; i < 6; ++i) switches += " s" + std::to_string(i);
  const auto task = Ground(R"((define (domain d) (:types place switch)
    (:predicates (at ?p - place) (next ?p ?q - place) (on ?s - switch) (powered))
    (:derived (powered) (exists (?s - switch) (on ?s)))
    (:action go :parameters (?p ?q - place) :precondition (and (at ?p) (next ?p ?q))
      :effect (and (at ?q) (not (at ?p))))
    (:action turn :parameters (?s - switch) :effect (and (when (on ?s) (not (on ?s))) (when (not (on ?s)) (on ?s))))))",
                           "(define (problem p) (:domain d) (:objects a b c d - place" + switches +
                               " - switch) (:init (at a) (next a b) (next b c) (next c d)) (:goal (at d)))");
  const RelevantTask relevant = KeepRelevant(task);
  EXPECT_EQ(relevant.task->actions().size(), 3u);
  EXPECT_EQ(relevant.task->atoms().size(), 4u);
  double all = 0, few = 0;
  EXPECT_GE(Expansions(task, &all), 20u);
  EXPECT_LE(Expansions(relevant.task, &few), 3u);
  EXPECT_EQ(all, 3);
  EXPECT_EQ(few, 3);
}

// Its sibling: what is asked for through conditions of effects and negations stays.
TEST(RelevanceTest, IrrelevantFacts_WhatHindersIsKept) {
  const auto task = Ground(R"((define (domain d) (:predicates (hot) (wet) (dry) (shut))
    (:action heat :effect (and (hot) (when (not (shut)) (wet))))
    (:action shut :effect (shut))
    (:action idle :effect (dry))))",
                           "(define (problem p) (:domain d) (:goal (and (hot) (not (wet)))))");
  const RelevantTask relevant = KeepRelevant(task);
  ASSERT_EQ(relevant.task->actions().size(), 2u);
  EXPECT_EQ(relevant.task->actions()[ActionId(1)].name, "shut()");
  EXPECT_EQ(task->actions()[relevant.actions[ActionId(1)]].name, "shut()");
  double cost = 0;
  Expansions(relevant.task, &cost);
  EXPECT_EQ(cost, 2);
}

TEST(RelevanceTest, ACheapestPlanCostsTheSameAndIsOneOfTheWholeTask) {
  int smaller = 0, solved = 0;
  for (uint64_t seed = 0; seed < 3000; ++seed) {
    const oracle::RandomTask random(seed, 9);
    const auto task = Ground(random.domain, random.problem);
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + random.domain + random.problem);
    const RelevantTask relevant = KeepRelevant(task);
    smaller += relevant.task->actions().size() < task->actions().size();
    SkeletonSearch whole(task, {.blind = true, .first_at_once = true});
    const SearchOutcome known = whole.Next();
    for (const bool blind : {true, false}) {
      SkeletonSearch search(relevant.task, {.blind = blind, .first_at_once = true});
      const SearchOutcome outcome = search.Next();
      ASSERT_EQ(outcome.status, known.status);
      if (!outcome.found()) continue;
      ++solved;
      ASSERT_EQ(outcome.skeleton->cost, known.skeleton->cost);
      symbolic::State state = task->initial_state();
      for (const ActionId action : outcome.skeleton->actions) {
        const ActionId original = relevant.actions[action];
        ASSERT_TRUE(task->IsApplicable(original, state));
        state = task->Apply(original, state);
      }
      ASSERT_TRUE(task->IsGoal(state));
    }
  }
  EXPECT_GT(smaller, 1000);
  EXPECT_GT(solved, 500);
}

}  // namespace
}  // namespace tether::task
