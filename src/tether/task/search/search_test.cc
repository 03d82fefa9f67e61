#include <algorithm>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/symbolic/domains.h"
#include "tether/task/search/skeleton.h"

namespace tether::task {
namespace {

using symbolic::Task;
namespace domains = symbolic::domains;

struct Found {
  double cost = -1;
  uint64_t expanded = 0;
};

Found Cheapest(const std::shared_ptr<const symbolic::Problem>& problem, bool blind = false) {
  SkeletonSearch search(Task::Ground(problem), {.blind = blind, .first_at_once = true});
  const SearchOutcome outcome = search.Next();
  Found found;
  found.expanded = search.graph().expanded();
  if (!outcome.found()) return found;
  found.cost = outcome.skeleton->cost;
  symbolic::State state = search.task().initial_state();
  for (const ActionId action : outcome.skeleton->actions) {
    EXPECT_TRUE(search.task().IsApplicable(action, state));
    state = search.task().Apply(action, state);
  }
  EXPECT_TRUE(search.task().IsGoal(state));
  return found;
}

TEST(SearchTest, CompetitionInstancesHaveTheirKnownOptima) {
  EXPECT_EQ(Cheapest(domains::Blocks4()).cost, 6);
  EXPECT_EQ(Cheapest(domains::Blocks8()).cost, 18);
  EXPECT_EQ(Cheapest(domains::Gripper(4)).cost, 11);
  EXPECT_EQ(Cheapest(domains::Logistics4()).cost, 20);
  EXPECT_EQ(Cheapest(domains::Logistics6()).cost, 25);
  const Found depot = Cheapest(domains::Depot()), blind = Cheapest(domains::Depot(), true);
  EXPECT_EQ(depot.cost, blind.cost);
  EXPECT_LT(depot.expanded * 20, blind.expanded);
}

TEST(SearchTest, LandmarksKeepExpansionsFew) {
  EXPECT_LE(Cheapest(domains::Blocks8()).expanded, 400u);
  EXPECT_LE(Cheapest(domains::Logistics6()).expanded, 2000u);
}

}  // namespace
}  // namespace tether::task
