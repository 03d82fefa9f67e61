#include "tether/task/symmetry/symmetry.h"

#include <algorithm>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/symbolic/domains.h"
#include "testing/symbolic/naive.h"
#include "tether/common/random.h"
#include "tether/ltl/formula/parser.h"
#include "tether/task/search/skeleton.h"

namespace tether::task {
namespace {

using symbolic::State;
using symbolic::Task;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
namespace domains = symbolic::domains;

using Names = std::vector<std::vector<std::string>>;

Names ClassesOf(const Product& product) {
  Names names;
  for (const std::vector<int>& members : Symmetry(product).Classes()) {
    names.emplace_back();
    for (int object : members) names.back().push_back(product.task().problem().objects[object].name);
  }
  return names;
}

TemporalGoal Goal(const std::string& formula) {
  return {ltl::ParseFormula(formula), ltl::Semantics::kCosafe, {}};
}

TEST(SymmetryTest, FindsWhatCanBeExchanged) {
  EXPECT_THAT(ClassesOf(Product(Task::Ground(domains::Gripper(4)))),
              ElementsAre(ElementsAre("ball1", "ball2", "ball3", "ball4")));
  EXPECT_THAT(ClassesOf(Product(Task::Ground(domains::Blocks8()))), IsEmpty());
  // Two packages from one place to one other.
  EXPECT_THAT(ClassesOf(Product(Task::Ground(domains::Logistics4()))),
              ElementsAre(ElementsAre("obj11", "obj13"), ElementsAre("obj12", "obj22"),
                          ElementsAre("obj21", "obj23")));
}

TEST(SymmetryTest, AFormulaTellsObjectsApart) {
  const auto task = Task::Ground(domains::Gripper(7));
  const auto classes = [&](const std::string& formula) { return ClassesOf(Product(task, Goal(formula))); };
  const auto others = ElementsAre("ball3", "ball4", "ball5", "ball6", "ball7");
  EXPECT_THAT(classes("F at(ball1,roomb)"),
              ElementsAre(ElementsAre("ball2", "ball3", "ball4", "ball5", "ball6", "ball7")));
  // One part after the other: which of the two came first is in the automaton's state.
  EXPECT_THAT(classes("F at(ball1,roomb) & F at(ball2,roomb)"), ElementsAre(others));
  EXPECT_THAT(classes("F(at(ball1,roomb) -> at(ball2,roomb))"), ElementsAre(others));
  EXPECT_THAT(classes("F(at(ball1,roomb) & at(ball2,roomb))"),
              ElementsAre(others, ElementsAre("ball1", "ball2")));
  EXPECT_THAT(classes("F(at(ball3,roomb) | at(ball2,roomb) xor at(ball1,roomb))"),
              ElementsAre(ElementsAre("ball4", "ball5", "ball6", "ball7"), ElementsAre("ball1", "ball2")));
}

TEST(SymmetryTest, ARepresentativeIsTheSameForAllImages) {
  Random random(1);
  for (const auto& problem : {domains::Gripper(4), domains::Logistics4()}) {
    const auto task = Task::Ground(problem);
    Product product(task);
    Symmetry symmetry(product);
    const Names classes = ClassesOf(product);
    State state = task->initial_state();
    std::vector<ActionId> applicable;
    for (int step = 0; step < 500; ++step) {
      task->FindApplicable(state, applicable);
      state = task->Apply(applicable[ToIndex(random.Index(static_cast<int>(applicable.size())))], state);
      State image = state, canonical = state;
      for (const std::vector<int>& members : symmetry.Classes()) {
        const auto pick = [&] { return members[random.Index(static_cast<int>(members.size()))]; };
        image = ExchangeObjects(*task, image, pick(), pick());
      }
      const bool changed = symmetry.Canonicalize(canonical);
      EXPECT_EQ(changed, canonical != state);
      symmetry.Canonicalize(image);
      ASSERT_EQ(image, canonical);
      EXPECT_FALSE(symmetry.Canonicalize(image));
    }
  }
}

TEST(SymmetryTest, ChangesNoResult) {
  const auto skeletons = [](const std::shared_ptr<const Task>& task, const std::optional<TemporalGoal>& goal,
                            bool symmetry, size_t most, uint64_t* expanded) {
    SkeletonSearch search(std::make_unique<Product>(task, goal), {.symmetry = symmetry});
    std::vector<std::vector<ActionId>> found;
    while (found.size() < most) {
      SearchOutcome outcome = search.Next();
      if (!outcome.found()) break;
      found.push_back(std::move(outcome.skeleton->actions));
    }
    *expanded = search.graph().expanded();
    return found;
  };
  uint64_t with = 0, without = 0;
  const auto gripper = Task::Ground(domains::Gripper(4));
  for (const std::string formula : {"", "F(at(ball1,roomb) & at(ball2,roomb)) & F carry(ball3,left)"}) {
    const std::optional<TemporalGoal> goal = formula.empty() ? std::nullopt : std::optional(Goal(formula));
    EXPECT_EQ(skeletons(gripper, goal, true, 1000, &with), skeletons(gripper, goal, false, 1000, &without));
    EXPECT_LT(with, without);
  }
  const auto logistics = Task::Ground(domains::Logistics4());
  EXPECT_EQ(skeletons(logistics, {}, true, 300, &with), skeletons(logistics, {}, false, 300, &without));
  // Random problems have few objects, and some of them are alike.
  int alike = 0;
  for (uint64_t seed = 0; seed < 300; ++seed) {
    const symbolic::naive::RandomProblem random(seed, {.costs = seed % 2 == 1, .derived = seed % 3 == 0});
    const auto task = Task::Ground(
        symbolic::ParseProblem(random.problem(), "p", symbolic::ParseDomain(random.domain(), "d")));
    alike += !Symmetry(Product(task)).trivial();
    ASSERT_EQ(skeletons(task, {}, true, 40, &with), skeletons(task, {}, false, 40, &without)) << seed;
  }
  EXPECT_GT(alike, 10);
}

TEST(SymmetryTest, WhatIsForbiddenIsToldApart) {
  const auto task = Task::Ground(domains::Gripper(3));
  Product product(task);
  product.Forbid(task->FindAction("pick(ball2,rooma,left)"));
  EXPECT_THAT(ClassesOf(product), ElementsAre(ElementsAre("ball1", "ball3")));
  auto same = std::make_unique<Product>(task);
  same->Forbid(task->FindAction("pick(ball2,rooma,left)"));
  SkeletonSearch search(std::move(same));
  const SearchOutcome outcome = search.Next();
  ASSERT_TRUE(outcome.found());
  EXPECT_EQ(outcome.skeleton->cost, 9);
}

}  // namespace
}  // namespace tether::task
