#include "tether/task/potentials.h"

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/symbolic/domains_testing.h"
#include "tether/symbolic/naive_testing.h"
#include "tether/task/landmark_cut.h"
#include "tether/task/state_graph.h"

namespace tether::task {
namespace {

using symbolic::Mutexes;
using symbolic::Task;
using symbolic::Variable;

bool MayMerge(const Task& task, const Variable& a, const Variable& b) {
  for (int atom : a.atoms) {
    if (std::find(b.atoms.begin(), b.atoms.end(), atom) != b.atoms.end()) return false;
  }
  for (const symbolic::GroundAction& action : task.actions()) {
    for (const symbolic::GroundEffect& effect : action.effects) {
      if (effect.condition.always()) continue;
      for (const auto* atoms : {&effect.adds, &effect.deletes}) {
        for (int atom : *atoms) {
          for (const auto* variable : {&a, &b}) {
            if (std::find(variable->atoms.begin(), variable->atoms.end(), atom) != variable->atoms.end())
              return false;
          }
        }
      }
    }
  }
  return true;
}

/// Whatever the weights, and whichever variables are merged: no estimate is above the true distance.
void ExpectAdmissible(const std::shared_ptr<const Task>& task, Random& random, int* merged, int* shifted) {
  Product product(task);
  StateGraph graph(product, {.blind = true});
  while (graph.bound() != StateGraph::kFar && graph.states() < 1000) graph.ExpandNext();
  if (graph.bound() != StateGraph::kFar) return;
  const std::vector<int64_t> distance = graph.GoalDistances();
  const auto mutexes = Mutexes::Find(*task);
  ASSERT_TRUE(mutexes.has_value());
  const std::vector<Variable> variables = symbolic::FindVariables(*task, *mutexes);
  std::optional<Merge> merge;
  // Of one atom at most one holds.
  std::vector<Variable> mergeable = variables;
  for (size_t i = 0; i < task->atoms().size(); ++i) {
    if (!task->IsDerived(static_cast<int>(i))) mergeable.push_back({{static_cast<int>(i)}, false});
  }
  for (int trial = 0; trial < 8 && mergeable.size() > 1 && !merge; ++trial) {
    const int count = static_cast<int>(mergeable.size());
    const Variable& a = mergeable[static_cast<size_t>(random.Index(count))];
    const Variable& b = mergeable[static_cast<size_t>(random.Index(count))];
    if (&a != &b && MayMerge(*task, a, b)) merge = Merge{a, b};
  }
  *merged += merge.has_value();
  const Relaxation relaxation =
      merge ? Relaxation(product, false, *merge, *mutexes) : Relaxation(product, false);
  LandmarkCut cut(relaxation);
  Potentials potentials(product, relaxation, *mutexes, variables);
  std::vector<int> facts;
  for (int round = 0; round < 6; ++round) {
    for (size_t i = 0; i < graph.states(); ++i) {
      const symbolic::StateView state = graph.state(static_cast<int>(i));
      relaxation.FindFacts(state, facts);
      const int64_t estimate = cut.Evaluate(facts);
      if (distance[i] == StateGraph::kFar) continue;
      ASSERT_NE(estimate, LandmarkCut::kDeadEnd);
      ASSERT_LE(estimate + potentials.Offset(state), distance[i]);
    }
    if (potentials.directions().empty()) return;
    for (int k = 0; k < 3; ++k) {
      const auto& direction = potentials.directions()[static_cast<size_t>(
          random.Index(static_cast<int>(potentials.directions().size())))];
      *shifted += potentials.Shift(direction, random.Index(2) == 0 ? 1 : -1);
    }
    cut.SetCosts(potentials.costs());
  }
}

TEST(PotentialsTest, NoWeightsMakeAnEstimateTooHigh) {
  Random random(1);
  int merged = 0, shifted = 0;
  for (uint64_t seed = 0; seed < 3000; ++seed) {
    const symbolic::naive::RandomProblem problem(seed, {.costs = seed % 2 == 1, .derived = seed % 3 == 0});
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + problem.domain() + problem.problem());
    const auto task = Task::Ground(
        symbolic::ParseProblem(problem.problem(), "p", symbolic::ParseDomain(problem.domain(), "d")));
    ASSERT_NO_FATAL_FAILURE(ExpectAdmissible(task, random, &merged, &shifted));
  }
  EXPECT_GT(merged, 100);
  EXPECT_GT(shifted, 1000);
}

TEST(PotentialsTest, NorInKnownDomains) {
  Random random(2);
  int merged = 0, shifted = 0;
  for (int trial = 0; trial < 40; ++trial) {
    for (const auto& problem : {symbolic::domains::Gripper(2), symbolic::domains::Blocks4()})
      ASSERT_NO_FATAL_FAILURE(ExpectAdmissible(Task::Ground(problem), random, &merged, &shifted));
  }
  EXPECT_GT(merged, 20);
  EXPECT_GT(shifted, 100);
}

}  // namespace
}  // namespace tether::task
