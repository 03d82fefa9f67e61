#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "testing/symbolic/domains.h"
#include "testing/symbolic/naive.h"
#include "testing/task/random_formula.h"
#include "tether/common/random.h"
#include "tether/ltl/formula/parser.h"
#include "tether/task/search/greedy.h"
#include "tether/task/search/skeleton.h"

namespace tether::task {
namespace {

using symbolic::Task;
using symbolic::naive::RandomProblem;

std::shared_ptr<const Task> RandomTask(uint64_t seed, std::string* text) {
  const RandomProblem random(seed, {.costs = seed % 2 == 1, .derived = seed % 3 == 0});
  *text = "seed " + std::to_string(seed) + "\n" + random.domain() + random.problem();
  return Task::Ground(
      symbolic::ParseProblem(random.problem(), "p", symbolic::ParseDomain(random.domain(), "d")));
}

/// Estimates are made stronger after two expansions, so that it happens in small tasks too.
double CheapestCost(const std::shared_ptr<const Task>& task, const std::optional<TemporalGoal>& goal,
                    bool blind, bool at_once = true) {
  SkeletonSearch search(std::make_unique<Product>(task, goal),
                        {.blind = blind, .strengthen_after = 2, .first_at_once = at_once});
  const SearchOutcome outcome = search.Next();
  EXPECT_TRUE(outcome.found() || outcome.status == SearchStatus::kExhausted);
  return outcome.found() ? outcome.skeleton->cost : -1;
}

int strengthened = 0;

/// The estimate is never more than the true distance in any state that can be reached, before it is
/// strengthened and after, and in what interchangeable objects make of these states.
void ExpectAdmissible(Product& product) {
  StateGraph graph(product, {.blind = true});
  while (graph.bound() != StateGraph::kFar && graph.states() < 3000) graph.ExpandNext();
  if (graph.bound() != StateGraph::kFar) return;
  const std::vector<int64_t> distance = graph.GoalDistances().values();
  Estimate estimate(product, false, false);
  Symmetry symmetry(product);
  std::vector<symbolic::State> samples;
  for (size_t i = 0; i < graph.states(); i += 1 + graph.states() / 8) {
    const symbolic::StateView view = graph.state(static_cast<int>(i));
    samples.emplace_back(view.begin(), view.end());
  }
  const auto expect = [&] {
    for (size_t i = 0; i < graph.states(); ++i) {
      const symbolic::StateView view = graph.state(static_cast<int>(i));
      symbolic::State state(view.begin(), view.end());
      for (const bool exchanged : {false, true}) {
        if (exchanged && !symmetry.Canonicalize(state)) break;
        const int64_t guess = estimate.Evaluate(state);
        ASSERT_LE(guess, distance[i]);
        ASSERT_TRUE(distance[i] != 0 || guess == 0);
      }
    }
  };
  ASSERT_NO_FATAL_FAILURE(expect());
  for (int round = 0; round < 2; ++round) {
    if (!estimate.Strengthen(samples, symmetry.Exchanges(), 2000)) return;
    ++strengthened;
    ASSERT_NO_FATAL_FAILURE(expect());
  }
}

/// A random conjunction of literals over the task's atoms, as PDDL and as a temporal formula.
struct RandomGoal {
  std::string pddl, formula;
};

std::string Proposition(const Task& task, int atom) {
  std::string name = task.AtomName(task.atoms()[atom]);
  if (name.ends_with("()")) name.resize(name.size() - 2);
  return name;
}

RandomGoal MakeGoal(const Task& task, Random& random) {
  RandomGoal goal{"(and", ""};
  for (int count = 1 + random.Index(3); count > 0; --count) {
    const int index = random.Index(static_cast<int>(task.atoms().size()));
    const symbolic::Atom& atom = task.atoms()[index];
    const bool positive = random.Index(3) > 0;
    std::string words = "(" + task.domain().predicates[atom.predicate].name;
    for (int argument : atom.arguments) words += " " + task.problem().objects[argument].name;
    words += ")";
    goal.pddl += positive ? " " + words : " (not " + words + ")";
    goal.formula +=
        (goal.formula.empty() ? "" : " & ") + std::string(positive ? "" : "!") + Proposition(task, index);
  }
  goal.pddl += ")";
  return goal;
}

TEST(SearchLawTest, AStarFindsWhatDijkstraFinds) {
  int solved = 0;
  for (uint64_t seed = 0; seed < 4000; ++seed) {
    std::string text;
    const auto task = RandomTask(seed, &text);
    SCOPED_TRACE(text);
    const double cost = CheapestCost(task, {}, true);
    solved += cost > 0;
    ASSERT_EQ(CheapestCost(task, {}, false), cost);
    ASSERT_EQ(CheapestCost(task, {}, false, false), cost);
    Product product(task);
    ASSERT_NO_FATAL_FAILURE(ExpectAdmissible(product));
    const GreedyResult greedy = FindGreedily(product);
    ASSERT_EQ(greedy.skeleton.has_value(), cost >= 0);
    if (!greedy.skeleton) continue;
    ASSERT_GE(greedy.skeleton->cost, cost);
    symbolic::State state = task->initial_state();
    for (const ActionId action : greedy.skeleton->actions) {
      ASSERT_TRUE(task->IsApplicable(action, state));
      state = task->Apply(action, state);
    }
    ASSERT_TRUE(task->IsGoal(state));
  }
  EXPECT_GT(solved, 100);
}

std::string Shuffled(std::string letters, Random& random) {
  for (size_t i = letters.size(); i > 1; --i) {
    std::swap(letters[i - 1], letters[random.Index(static_cast<int>(i))]);
  }
  return letters;
}

TEST(SearchLawTest, RandomTowersCostWhatDijkstraSays) {
  Random random(3);
  for (int trial = 0; trial < 60; ++trial) {
    std::vector<std::string> towers[2];
    for (auto& side : towers) {
      const std::string blocks = Shuffled("ABCDE", random);
      for (size_t begin = 0, end; begin < blocks.size(); begin = end) {
        end = begin + 1 + static_cast<size_t>(random.Index(static_cast<int>(blocks.size() - begin)));
        side.push_back(blocks.substr(begin, end - begin));
      }
    }
    const auto task = Task::Ground(symbolic::domains::Blocks(towers[0], towers[1]));
    ASSERT_EQ(CheapestCost(task, {}, false), CheapestCost(task, {}, true));
    if (trial < 20) {
      Product product(task);
      ASSERT_NO_FATAL_FAILURE(ExpectAdmissible(product));
    }
    // The towers have to be built in two steps, whose ends are in either order.
    const std::string on = "on(" + towers[1][0].substr(0, 1) + "," + towers[0][0].substr(0, 1) + ")";
    const std::string formula =
        "F(" + on + " & X[!] F !" + on + ") & F holding(C) & (!holding(A) U holding(B))";
    const TemporalGoal goal{ltl::ParseFormula(formula), ltl::Semantics::kCosafe, {}};
    ASSERT_EQ(CheapestCost(task, goal, false), CheapestCost(task, goal, true)) << formula;
  }
}

TEST(SearchLawTest, AGoalAndItsEventuallyCostTheSame) {
  int solved = 0;
  Random random(1);
  for (uint64_t seed = 0; seed < 600; ++seed) {
    std::string text;
    const auto task = RandomTask(seed, &text);
    if (task->atoms().empty()) continue;
    const RandomGoal goal = MakeGoal(*task, random);
    SCOPED_TRACE(text + goal.pddl);
    const auto as_goal = Task::Ground(symbolic::WithGoal(task->problem(), goal.pddl, {}));
    const double cost = CheapestCost(as_goal, {}, true);
    solved += cost > 0;
    const ltl::Formula formula = ltl::ParseFormula("F(" + goal.formula + ")");
    for (const auto semantics : {ltl::Semantics::kCosafe, ltl::Semantics::kLtlf}) {
      ASSERT_EQ(CheapestCost(task, TemporalGoal{formula, semantics, {}}, false), cost);
      ASSERT_EQ(CheapestCost(task, TemporalGoal{formula, semantics, {}}, true), cost);
    }
  }
  EXPECT_GT(solved, 50);
}

/// A random formula over some of the task's atoms.
std::string RandomFormula(const Task& task, Random& random, int depth) {
  std::vector<std::string> propositions;
  for (int atom = 0; atom < static_cast<int>(task.atoms().size()); ++atom)
    propositions.push_back(Proposition(task, atom));
  return task::RandomFormula(propositions, 2, random, depth);
}

TEST(SearchLawTest, TemporalGoalsCostWhatDijkstraSays) {
  int solved = 0;
  Random random(2);
  for (uint64_t seed = 0; seed < 600; ++seed) {
    std::string text;
    const auto task = RandomTask(seed, &text);
    if (task->atoms().empty()) continue;
    const std::string formula = RandomFormula(*task, random, 3);
    SCOPED_TRACE(text + formula);
    const TemporalGoal goal{ltl::ParseFormula(formula), ltl::Semantics::kLtlf, {}};
    const double cost = CheapestCost(task, goal, true);
    solved += cost > 0;
    ASSERT_EQ(CheapestCost(task, goal, false), cost);
    Product product(task, goal);
    ASSERT_NO_FATAL_FAILURE(ExpectAdmissible(product));
    ASSERT_EQ(FindGreedily(product).skeleton.has_value(), cost >= 0);
  }
  EXPECT_GT(solved, 50);
}

/// A hand that carries one thing at a time between places, through a hub.
const char* const kErrands = R"((define (domain errands)
  (:types place item)
  (:predicates (at ?p - place) (hub ?p - place) (in ?i - item ?p - place) (held ?i - item) (empty) (full ?p - place))
  (:action go :parameters (?p - place)
    :precondition (and (not (at ?p)) (exists (?h - place) (and (hub ?h) (or (at ?h) (= ?h ?p)))))
    :effect (and (forall (?q - place) (not (at ?q))) (at ?p)))
  (:action take :parameters (?i - item ?p - place) :precondition (and (empty) (at ?p) (in ?i ?p))
    :effect (and (not (empty)) (held ?i) (not (in ?i ?p)) (not (full ?p))))
  (:action put :parameters (?i - item ?p - place)
    :precondition (and (held ?i) (at ?p) (not (hub ?p)) (not (full ?p)))
    :effect (and (empty) (not (held ?i)) (in ?i ?p) (full ?p)))))";

std::shared_ptr<const Task> Errands(Random& random) {
  const int places = 3 + random.Index(2), items = 1 + random.Index(2);
  std::string objects = "hub", init = "(empty) (hub hub) (at hub)";
  for (int p = 0; p < places; ++p) objects += " p" + std::to_string(p);
  objects += " - place";
  const int first = random.Index(places);
  for (int i = 0; i < items; ++i) {
    const std::string item = "i" + std::to_string(i), place = "p" + std::to_string((first + i) % places);
    objects += " " + item + " - item";
    init += " (in " + item + " " + place + ") (full " + place + ")";
  }
  return Task::Ground(symbolic::ParseProblem(
      "(define (problem p) (:domain errands) (:objects " + objects + ") (:init " + init + ") (:goal (and)))",
      "p", symbolic::ParseDomain(kErrands, "d")));
}

TEST(SearchLawTest, ErrandsCostWhatDijkstraSays) {
  strengthened = 0;
  Random random(4);
  for (int trial = 0; trial < 150; ++trial) {
    const auto task = Errands(random);
    const auto in = [&] {
      const int item = random.Index(static_cast<int>(task->problem().FindObject("i1") >= 0 ? 2 : 1));
      return "in(i" + std::to_string(item) + ",p" + std::to_string(random.Index(3)) + ")";
    };
    std::string formula;
    for (int count = 1 + random.Index(3); count > 0; --count) {
      switch (random.Index(4)) {
        case 0:
          formula += "F(" + in() + " & X F(" + in() + " & X F " + in() + "))";
          break;
        case 1:
          formula += "(!" + in() + " U " + in() + ")";
          break;
        case 2:
          formula += "F(" + in() + " & " + in() + ")";
          break;
        default:
          formula += "F(" + in() + " & X F " + in() + ")";
      }
      if (count > 1) formula += " & ";
    }
    SCOPED_TRACE(formula);
    const TemporalGoal goal{ltl::ParseFormula(formula), ltl::Semantics::kCosafe, {}};
    ASSERT_EQ(CheapestCost(task, goal, false), CheapestCost(task, goal, true));
    Product product(task, goal);
    ASSERT_NO_FATAL_FAILURE(ExpectAdmissible(product));
  }
  EXPECT_GT(strengthened, 100);
}

}  // namespace
}  // namespace tether::task
