#include "tether/planning/skeleton/subsequences.h"

#include <algorithm>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/ltl/formula/parser.h"
#include "tether/symbolic/pddl/pddl.h"
#include "tether/task/search/skeleton.h"

namespace tether::planning {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

// Blocks that are picked and put down; looking at one changes only that it was seen.
constexpr const char* kDomain = R"((define (domain blocks)
  (:requirements :strips :negative-preconditions)
  (:predicates (held ?a) (free) (on ?a ?b) (seen ?a) (place ?b) (block ?a))
  (:action pick :parameters (?a) :precondition (and (free) (block ?a))
    :effect (and (held ?a) (not (free))))
  (:action put :parameters (?a ?b) :precondition (and (held ?a) (place ?b))
    :effect (and (on ?a ?b) (free) (not (held ?a))))
  (:action look :parameters (?a) :precondition (and (free) (block ?a)) :effect (seen ?a))))";

std::shared_ptr<const symbolic::Task> Blocks(const std::string& goal) {
  const std::string problem =
      "(define (problem p) (:domain blocks) (:objects a b c d tray bin) (:init (free) (place tray) (place "
      "bin) "
      "(block a) (block b) (block c) (block d)) (:goal " +
      goal + "))";
  return symbolic::Task::Ground(
      symbolic::ParseProblem(problem, "problem", symbolic::ParseDomain(kDomain, "domain")));
}

class SubsequencesTest : public ::testing::Test {
 protected:
  void Use(const std::string& goal, const std::string& formula = "") {
    task_ = Blocks(goal);
    std::optional<task::TemporalGoal> temporal;
    if (!formula.empty()) temporal = task::TemporalGoal{ltl::ParseFormula(formula), {}, {}};
    subsequences_ = std::make_unique<Subsequences>(std::make_unique<task::Product>(task_, temporal));
  }
  std::vector<ActionId> Numbers(const std::vector<std::string>& names) const {
    std::vector<ActionId> numbers;
    for (const std::string& name : names) numbers.push_back(task_->FindAction(name));
    return numbers;
  }
  std::string Text(const std::vector<ActionId>& actions) const {
    std::string text;
    for (const ActionId action : actions) text += (text.empty() ? "" : " ") + task_->actions()[action].name;
    return text;
  }
  std::vector<std::string> Find(const std::vector<std::string>& names) {
    std::vector<std::string> found;
    for (const Subsequence& part : subsequences_->Find(Numbers(names))) found.push_back(Text(part.actions));
    return found;
  }

  std::shared_ptr<const symbolic::Task> task_;
  std::unique_ptr<Subsequences> subsequences_;
};

TEST_F(SubsequencesTest, WhatIsNeededHasNoPartThatDoes) {
  Use("(and (on a tray) (on b tray))");
  EXPECT_THAT(Find({"pick(a)", "put(a,tray)", "pick(b)", "put(b,tray)"}), IsEmpty());
}

TEST_F(SubsequencesTest, EveryPartThatDoesIsFoundShortOnesFirst) {
  Use("(on b tray)");
  EXPECT_THAT(
      Find({"look(a)", "look(b)", "pick(b)", "put(b,tray)"}),
      ElementsAre("pick(b) put(b,tray)", "look(a) pick(b) put(b,tray)", "look(b) pick(b) put(b,tray)"));
  // What is left out must leave the rest applicable: not pick(a) alone.
  EXPECT_THAT(Find({"pick(a)", "put(a,bin)", "pick(b)", "put(b,tray)"}), ElementsAre("pick(b) put(b,tray)"));
}

TEST_F(SubsequencesTest, ATemporalGoalMayNeedWhatTheLastStateDoesNot) {
  Use("(on b tray)", "F(seen(a) & F on(b,tray))");
  EXPECT_THAT(Find({"look(a)", "pick(b)", "put(b,tray)"}), IsEmpty());
  EXPECT_THAT(Find({"look(a)", "look(b)", "pick(b)", "put(b,tray)"}),
              ElementsAre("look(a) pick(b) put(b,tray)"));
}

TEST_F(SubsequencesTest, PartsThatComeBackToAStateAreTold) {
  Use("(on b tray)");
  for (const Subsequence& part :
       subsequences_->Find(Numbers({"look(a)", "look(a)", "pick(b)", "put(b,tray)"})))
    EXPECT_EQ(part.revisits, Text(part.actions) == "look(a) look(a) pick(b) put(b,tray)");
}

TEST_F(SubsequencesTest, LongSequencesLoseOneActionAfterTheOther) {
  Use("(and (on a tray) (on b tray) (on c tray) (on d tray))");
  std::vector<std::string> long_one;
  for (const std::string block : {"a", "b", "c", "d"}) {
    for (const std::string& action : {"look(" + block + ")", "pick(" + block + ")", "put(" + block + ",bin)",
                                      "pick(" + block + ")", "put(" + block + ",tray)"})
      long_one.push_back(action);
  }
  ASSERT_GT(long_one.size(), Subsequences::kExact);
  const std::vector<std::string> parts = Find(long_one);
  ASSERT_FALSE(parts.empty());
  EXPECT_EQ(parts.front(), "pick(a) put(a,tray) pick(b) put(b,tray) pick(c) put(c,tray) pick(d) put(d,tray)");
  // Each action by itself, too.
  std::vector<std::string> without_the_last_look = long_one;
  without_the_last_look.erase(
      std::find(without_the_last_look.begin(), without_the_last_look.end(), "look(d)"));
  EXPECT_THAT(parts, ::testing::Contains(Text(Numbers(without_the_last_look))));
}

/// All parts, one by one.
std::set<std::vector<ActionId>> Naive(task::Product& product, const std::vector<ActionId>& actions) {
  std::set<std::vector<ActionId>> found;
  for (unsigned mask = 0; mask + 1 < (1u << actions.size()); ++mask) {
    std::vector<ActionId> part;
    symbolic::State state = *product.Start();
    bool done = true, early = false;
    for (size_t i = 0; i < actions.size() && done; ++i) {
      if ((mask >> i & 1) == 0) continue;
      early = early || product.IsGoal(state);
      std::vector<ActionId> applicable;
      product.FindApplicable(state, applicable);
      symbolic::State next(state.size());
      done = std::find(applicable.begin(), applicable.end(), actions[i]) != applicable.end() &&
             product.Apply(actions[i], state, next);
      part.push_back(actions[i]);
      state = next;
    }
    if (done && !early && product.IsGoal(state)) found.insert(part);
  }
  return found;
}

TEST_F(SubsequencesTest, AgreesWithTryingAllParts) {
  Use("(and (on a tray) (or (on b bin) (seen c)))");
  task::SkeletonSearch search(task_, {.max_actions = 6});
  task::Product product(task_);
  int looked_at = 0;
  while (looked_at < 400) {
    const auto outcome = search.Next();
    if (!outcome.found()) break;
    std::set<std::vector<ActionId>> found;
    for (const Subsequence& part : subsequences_->Find(outcome.skeleton->actions)) found.insert(part.actions);
    EXPECT_EQ(found, Naive(product, outcome.skeleton->actions)) << Text(outcome.skeleton->actions);
    ++looked_at;
  }
  EXPECT_GT(looked_at, 50);
}

TEST_F(SubsequencesTest, OrdersOfIndependentPartsHaveOneForm) {
  Use("(and (on a tray) (on b tray) (on c tray) (on d tray))");
  const auto normal = [&](const std::vector<std::string>& blocks) {
    std::vector<std::string> names;
    for (const std::string& block : blocks) {
      names.push_back("pick(" + block + ")");
      names.push_back("put(" + block + ",tray)");
    }
    return Text(subsequences_->NormalOrder(Numbers(names)));
  };
  std::vector<std::string> blocks{"a", "b", "c", "d"};
  std::set<std::string> forms;
  do {
    forms.insert(normal(blocks));
  } while (std::next_permutation(blocks.begin(), blocks.end()));
  EXPECT_EQ(forms.size(), 1u);
  // Each exchange of two neighbours, and of longer parts.
  EXPECT_EQ(subsequences_->Exchanged(Numbers({"pick(a)", "put(a,tray)", "pick(b)", "put(b,tray)"})).size(),
            1u);
  // What comes last on a block depends on the order.
  EXPECT_NE(Text(subsequences_->NormalOrder(Numbers({"pick(a)", "put(a,bin)", "pick(a)", "put(a,tray)"}))),
            Text(subsequences_->NormalOrder(Numbers({"pick(a)", "put(a,tray)", "pick(a)", "put(a,bin)"}))));
}

}  // namespace
}  // namespace tether::planning
