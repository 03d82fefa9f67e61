#include "tether/task/heuristics/potentials.h"

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "testing/symbolic/domains.h"
#include "testing/symbolic/naive.h"
#include "tether/common/random.h"
#include "tether/ltl/formula/parser.h"
#include "tether/task/heuristics/landmark_cut.h"
#include "tether/task/search/state_graph.h"

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

struct Counts {
  int merged = 0, tracked = 0, shifted = 0;
};

/// Whatever the weights, whichever variables are merged and parts of the automaton tracked: no estimate is
/// above the true distance.
void ExpectAdmissible(const std::shared_ptr<const Task>& task, const std::string& formula, Random& random,
                      Counts* counts) {
  std::optional<TemporalGoal> goal;
  if (!formula.empty()) goal = TemporalGoal{ltl::ParseFormula(formula), ltl::Semantics::kCosafe, {}};
  Product product(task, goal);
  StateGraph graph(product, {.blind = true});
  while (graph.bound() != StateGraph::kFar && graph.states() < 1000) graph.ExpandNext();
  if (graph.bound() != StateGraph::kFar) return;
  const std::vector<int64_t> distance = graph.GoalDistances().values();
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
    const Variable& a = mergeable[random.Index(count)];
    const Variable& b = mergeable[random.Index(count)];
    if (&a != &b && MayMerge(*task, a, b)) merge = Merge{a, b};
  }
  std::vector<Tracking> trackings;
  for (int part = 0; goal && part < product.automaton()->parts(); ++part) {
    for (const Variable& variable : mergeable) {
      auto tracking = Tracking::Make(product, part, variable, merge, *mutexes);
      if (!tracking || random.Index(3) == 0) continue;
      trackings.push_back(std::move(*tracking));
      break;
    }
  }
  counts->merged += merge.has_value();
  counts->tracked += static_cast<int>(trackings.size());
  const Relaxation relaxation(product, false, merge, trackings, *mutexes);
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
      const auto& direction =
          potentials.directions()[random.Index(static_cast<int>(potentials.directions().size()))];
      counts->shifted += potentials.Shift(direction, random.Index(2) == 0 ? 1 : -1);
    }
    cut.SetCosts(potentials.costs());
  }
}

std::string Proposition(const Task& task, int atom) {
  std::string name = task.AtomName(task.atoms()[atom]);
  if (name.ends_with("()")) name.resize(name.size() - 2);
  return name;
}

/// Some atoms have to become true and false and true again, each by itself.
std::string RandomFormula(const Task& task, Random& random) {
  std::string formula;
  for (int count = 1 + random.Index(2); count > 0 && !task.atoms().empty(); --count) {
    const int count_of_atoms = static_cast<int>(task.atoms().size());
    const std::string a = Proposition(task, random.Index(count_of_atoms));
    const std::string b = random.Index(2) == 0 ? "!" + a : Proposition(task, random.Index(count_of_atoms));
    formula += (formula.empty() ? "" : " & ") + ("F(" + a + " & X[!] F(" + b + " & X[!] F " + a + "))");
  }
  return formula;
}

TEST(PotentialsTest, NoWeightsMakeAnEstimateTooHigh) {
  Random random(1);
  Counts counts;
  for (uint64_t seed = 0; seed < 3000; ++seed) {
    const symbolic::naive::RandomProblem problem(seed, {.costs = seed % 2 == 1, .derived = seed % 3 == 0});
    const auto task = Task::Ground(
        symbolic::ParseProblem(problem.problem(), "p", symbolic::ParseDomain(problem.domain(), "d")));
    const std::string formula = seed % 4 < 2 ? RandomFormula(*task, random) : "";
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + problem.domain() + problem.problem() + formula);
    ASSERT_NO_FATAL_FAILURE(ExpectAdmissible(task, formula, random, &counts));
  }
  EXPECT_GT(counts.merged, 100);
  EXPECT_GT(counts.tracked, 100);
  EXPECT_GT(counts.shifted, 1000);
}

TEST(PotentialsTest, NorInKnownDomains) {
  Random random(2);
  Counts counts;
  const auto gripper = Task::Ground(symbolic::domains::Gripper(2)),
             blocks = Task::Ground(symbolic::domains::Blocks4());
  for (int trial = 0; trial < 40; ++trial) {
    for (const std::string formula :
         {"", "F(at(ball1,roomb) & X F(at(ball1,rooma) & X F at(ball1,roomb))) & F carry(ball2,left)"})
      ASSERT_NO_FATAL_FAILURE(ExpectAdmissible(gripper, formula, random, &counts));
    for (const std::string formula : {"", "F(on(A,B) & X F(on(A,C) & X F on(A,B)))"})
      ASSERT_NO_FATAL_FAILURE(ExpectAdmissible(blocks, formula, random, &counts));
  }
  EXPECT_GT(counts.merged, 40);
  EXPECT_GT(counts.tracked, 20);
  EXPECT_GT(counts.shifted, 200);
}

}  // namespace
}  // namespace tether::task
