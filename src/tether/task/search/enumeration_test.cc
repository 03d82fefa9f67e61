#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/task/enumeration.h"
#include "tether/ltl/formula/evaluate.h"
#include "tether/ltl/formula/parser.h"
#include "tether/task/search/greedy.h"
#include "tether/task/search/skeleton.h"

namespace tether::task {
namespace {

using oracle::Paths;
using oracle::Plan;
using symbolic::Task;

constexpr size_t kMostSteps = 20'000;
constexpr double kUnbounded = std::numeric_limits<double>::infinity();

uint64_t Setting(const char* name, uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

std::vector<std::string> Names(const Task& task, const std::vector<ActionId>& actions) {
  std::vector<std::string> names;
  for (const ActionId action : actions) names.push_back(task.actions()[action].name);
  return names;
}

int64_t CostOf(const Task& task, const std::vector<ActionId>& actions) {
  double cost = 0;
  for (const ActionId action : actions)
    cost += static_cast<double>(task.actions()[action].cost) * task.cost_unit();
  return static_cast<int64_t>(cost * symbolic::kMillion + 0.5);
}

struct Found {
  std::vector<Plan> plans;  ///< Sorted.
  SearchStatus ended = SearchStatus::kFound;
};

/// All that a search yields, which must come in the order of cost. With `stops`, it is given a limit on the
/// cost first, and interrupted now and then.
Found Enumerate(const std::shared_ptr<const Task>& task, const std::optional<TemporalGoal>& goal,
                const SkeletonOptions& options, bool stops = false) {
  SkeletonSearch search(std::make_unique<Product>(task, goal), options);
  Found found;
  double before = 0, most = stops ? 0 : kUnbounded;
  const SearchLimits interrupted{{.deadline = std::chrono::steady_clock::time_point{}}};
  while (true) {
    if (stops && found.plans.size() % 2 == 0) {
      EXPECT_EQ(search.Next(interrupted).status, SearchStatus::kTimeLimit);
    }
    const SearchOutcome outcome = search.Next({{}, most});
    found.ended = outcome.status;
    if (outcome.status == SearchStatus::kDepthLimit && most < kUnbounded) {
      most = most < 8 ? most + 1 : kUnbounded;
      continue;
    }
    if (!outcome.found()) break;
    EXPECT_LE(outcome.skeleton->cost, most);
    EXPECT_GE(outcome.skeleton->cost, before);
    before = outcome.skeleton->cost;
    if (options.unit_costs) {
      EXPECT_EQ(outcome.skeleton->cost, static_cast<double>(outcome.skeleton->actions.size()));
    }
    found.plans.push_back(
        {Names(*task, outcome.skeleton->actions), CostOf(*task, outcome.skeleton->actions)});
  }
  std::sort(found.plans.begin(), found.plans.end());
  return found;
}

/// Plans that come back to a state for the oracle, but not for an automaton with more states than needed.
std::vector<Plan> WithoutFiner(const std::vector<Plan>& plans, Paths& paths) {
  std::vector<Plan> kept;
  for (const Plan& plan : plans) {
    const Paths::Verdict verdict = paths.Judge(plan.actions);
    EXPECT_NE(verdict, Paths::Verdict::kNoPlan) << testing::PrintToString(plan.actions);
    if (verdict == Paths::Verdict::kPlan) kept.push_back(plan);
  }
  return kept;
}

struct Instance {
  std::string text;
  std::shared_ptr<const symbolic::Problem> problem;
  std::shared_ptr<const Task> task;
  std::optional<TemporalGoal> goal;
};

Instance Make(uint64_t seed, int attempt) {
  oracle::RandomTask random(seed, attempt);
  Instance made;
  made.text = "seed " + std::to_string(seed) + ", attempt " + std::to_string(attempt) + "\n" + random.domain +
              random.problem;
  made.problem = symbolic::ParseProblem(random.problem, "p", symbolic::ParseDomain(random.domain, "d"));
  made.task = Task::Ground(made.problem);
  if (!random.temporal || made.task->atoms().empty()) return made;
  std::vector<std::string> propositions;
  for (const symbolic::Atom& atom : made.task->atoms()) {
    std::string name = made.task->AtomName(atom);
    if (name.ends_with("()")) name.resize(name.size() - 2);
    propositions.push_back(name);
  }
  const std::string formula = random.Formula(propositions, 3);
  made.text += formula;
  made.goal = TemporalGoal{ltl::ParseFormula(formula), ltl::Semantics::kLtlf, {}};
  return made;
}

struct Search {
  const char* name;
  SkeletonOptions options;
  bool stops = false;
};

std::vector<Search> Searches() {
  return {{"astar", {.first_at_once = true}},
          {"astar, strengthened soon", {.strengthen_after = 2}},
          {"astar without symmetry", {.symmetry = false}},
          {"astar, stopped again and again", {}, true},
          {"dijkstra", {.blind = true, .first_at_once = true}},
          {"bfs", {.blind = true, .unit_costs = true}}};
}

/// What every search must find, and with which bound on the number of actions; -1: without one.
struct Expected {
  std::vector<Plan> plans;
  int longest = -1;
  bool cut_off = false;
};

std::optional<Expected> Expect(Paths& paths, bool revisits) {
  for (int longest : {-1, 6, 5, 4, 3, 2, 1}) {
    if (revisits && longest < 0) continue;
    if (auto plans = paths.All(longest, revisits, kMostSteps))
      return Expected{std::move(*plans), longest, paths.cut_off()};
  }
  return std::nullopt;
}

void CompareSearches(const Instance& instance, Paths& paths, const Expected& expected, bool revisits) {
  for (const Search& search : Searches()) {
    SCOPED_TRACE(search.name);
    SkeletonOptions options = search.options;
    options.skip_revisits = !revisits;
    if (expected.longest > 0) options.max_actions = expected.longest;
    Found found = Enumerate(instance.task, instance.goal, options, search.stops);
    if (instance.goal && !revisits) found.plans = WithoutFiner(found.plans, paths);
    ASSERT_EQ(found.plans, expected.plans);
    if (expected.longest < 0) {
      ASSERT_EQ(found.ended, SearchStatus::kExhausted);
    } else if (expected.cut_off) {
      ASSERT_TRUE(found.ended == SearchStatus::kDepthLimit || found.ended == SearchStatus::kExhausted);
    }
  }
}

/// What conflicts that are proved leave is enumerated too, whenever they come.
void CompareWithConflicts(const Instance& instance, const Expected& expected, uint64_t seed) {
  Random random(seed);
  SkeletonOptions options{.blind = seed % 2 == 0};
  if (expected.longest > 0) options.max_actions = expected.longest;
  SkeletonSearch search(std::make_unique<Product>(instance.task, instance.goal), options);
  std::vector<Conflict> conflicts;
  std::set<std::vector<std::string>> yielded;
  const auto ruled_out = [&](const std::vector<ActionId>& actions) {
    return std::any_of(conflicts.begin(), conflicts.end(),
                       [&](const Conflict& conflict) { return conflict.RulesOut(actions); });
  };
  while (true) {
    const SearchOutcome outcome = search.Next();
    if (!outcome.found()) break;
    const std::vector<ActionId>& actions = outcome.skeleton->actions;
    ASSERT_FALSE(ruled_out(actions));
    ASSERT_TRUE(yielded.insert(Names(*instance.task, actions)).second);
    if (actions.empty() || random.Index(3) > 0) continue;
    Conflict conflict;
    conflict.kind = Conflict::Kind::kProved;
    conflict.prefix = {actions.begin(), actions.begin() + 1 + random.Index(static_cast<int>(actions.size()))};
    conflict.anywhere = random.Index(4) == 0;
    search.AddConflict(conflict);
    conflicts.push_back(std::move(conflict));
  }
  for (const Plan& plan : expected.plans) {
    std::vector<ActionId> actions;
    for (const std::string& name : plan.actions) actions.push_back(instance.task->FindAction(name));
    ASSERT_TRUE(yielded.count(plan.actions) || ruled_out(actions)) << testing::PrintToString(plan.actions);
  }
}

void Compare(const Instance& instance, Paths& paths, const Expected& expected, bool revisits, uint64_t seed) {
  ASSERT_NO_FATAL_FAILURE(CompareSearches(instance, paths, expected, revisits));
  if (!revisits) {
    ASSERT_NO_FATAL_FAILURE(CompareWithConflicts(instance, expected, seed));
  }
  Product product(instance.task, instance.goal);
  const GreedyResult greedy = FindGreedily(product);
  if (greedy.skeleton) {
    ASSERT_NE(paths.Judge(Names(*instance.task, greedy.skeleton->actions)), Paths::Verdict::kNoPlan);
  } else {
    ASSERT_TRUE(expected.plans.empty());
  }
}

/// True if the task has several plans.
bool CompareWithOracle(uint64_t seed, int attempt) {
  const Instance instance = Make(seed, attempt);
  SCOPED_TRACE(instance.text);
  Paths paths(*instance.problem, instance.goal ? &*instance.goal : nullptr);
  const bool revisits = seed % 7 == 0;
  const auto expected = Expect(paths, revisits);
  EXPECT_TRUE(expected.has_value());
  if (expected) Compare(instance, paths, *expected, revisits, seed);
  return expected && expected->plans.size() > 1;
}

/// TETHER_ORACLE_TASKS seeds from TETHER_ORACLE_SEED on, in place of the test's own; of each, attempts until
/// a task has several plans.
TEST(EnumerationTest, EverySearchFindsWhatWalkingAllPathsFinds) {
  constexpr int kMostAttempts = 8;
  const uint64_t first = Setting("TETHER_ORACLE_SEED", 1), count = Setting("TETHER_ORACLE_TASKS", 600);
  uint64_t compared = 0, with_several = 0;
  for (uint64_t seed = first; seed < first + count && !HasFailure(); ++seed) {
    bool several = false;
    for (int attempt = 0; attempt < kMostAttempts && !several && !HasFailure(); ++attempt) {
      several = CompareWithOracle(seed, attempt);
      ++compared;
    }
    with_several += several;
  }
  std::printf("%lu tasks compared, %lu of them with several plans\n", compared, with_several);
  EXPECT_GT(with_several, count / 3);
}

std::vector<std::vector<std::string>> AllPlans(const std::string& domain, const std::string& problem,
                                               const SkeletonOptions& options) {
  const auto task = Task::Ground(symbolic::ParseProblem(problem, "p", symbolic::ParseDomain(domain, "d")));
  std::vector<std::vector<std::string>> plans;
  for (const Plan& plan : Enumerate(task, {}, options).plans) plans.push_back(plan.actions);
  return plans;
}

// Find enumeration_misses_plans: a level whose exploration only came to goal states.
TEST(EnumerationTest, PlansToAGoalStateThatIsClosedLateComeToo) {
  const std::string domain = R"((define (domain door) (:requirements :negative-preconditions)
    (:predicates (open) (wet))
    (:action close :parameters () :precondition (open) :effect (not (open)))
    (:action dry :parameters () :precondition (wet) :effect (not (wet)))))";
  const std::string problem =
      "(define (problem one) (:domain door) (:init (open) (wet)) (:goal (not (open))))";
  for (const Search& search : Searches()) {
    SCOPED_TRACE(search.name);
    EXPECT_THAT(
        AllPlans(domain, problem, search.options),
        testing::ElementsAre(testing::ElementsAre("close()"), testing::ElementsAre("dry()", "close()")));
  }
}

// Its sibling with a derived goal, where A* missed some: a graph is cut until nothing comes back.
TEST(EnumerationTest, PlansForADerivedGoalComeAll) {
  const std::string domain = R"((define (domain cut) (:requirements :adl :derived-predicates)
    (:predicates (link ?x ?y) (reach ?x ?y) (loop))
    (:derived (reach ?x ?y) (or (link ?x ?y) (exists (?z) (and (link ?x ?z) (reach ?z ?y)))))
    (:derived (loop) (exists (?x) (reach ?x ?x)))
    (:action unlink :parameters (?x ?y) :precondition (link ?x ?y) :effect (not (link ?x ?y)))))";
  const std::string problem = R"((define (problem p) (:domain cut) (:objects a b c d)
    (:init (link a b) (link b c) (link c a) (link c d) (link d b)) (:goal (not (loop)))))";
  const auto parsed = symbolic::ParseProblem(problem, "p", symbolic::ParseDomain(domain, "d"));
  Paths paths(*parsed);
  const std::vector<Plan> all = *paths.All(-1, false, kMostSteps);
  EXPECT_GT(all.size(), 10u);
  for (const Search& search : Searches()) {
    SCOPED_TRACE(search.name);
    EXPECT_EQ(Enumerate(Task::Ground(parsed), {}, search.options).plans, all);
  }
}

}  // namespace
}  // namespace tether::task
