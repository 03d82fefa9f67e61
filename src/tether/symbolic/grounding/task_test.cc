#include "tether/symbolic/grounding/task.h"

#include <cmath>
#include <deque>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/symbolic/domains.h"
#include "testing/symbolic/naive.h"

namespace tether::symbolic {
namespace {

using ::testing::ElementsAre;

std::shared_ptr<const Problem> Shipped(const std::string& name) {
  const std::string folder = std::string(TETHER_SOURCE_DIR) + "/scenarios/" + name;
  return ReadProblem(folder + "/domain.pddl", folder + "/problem.pddl");
}

std::vector<std::string> ApplicableNames(const Task& task, const State& state) {
  std::vector<std::string> names;
  for (size_t i = 0; i < task.actions().size(); ++i) {
    if (task.IsApplicable(ActionId(i), state)) names.push_back(task.actions()[ActionId(i)].name);
  }
  return names;
}

TEST(TaskTest, GroundsWorkspaceReach) {
  const auto task = Task::Ground(Shipped("workspace_reach"));
  EXPECT_THAT(task->TrueAtoms(task->initial_state()), ElementsAre("on(hook,table)", "on(box,table)"));
  EXPECT_THAT(ApplicableNames(*task, task->initial_state()), ElementsAre("pick(hook)"));
  const State held = task->Apply(task->FindAction("pick(hook)"), task->initial_state());
  EXPECT_THAT(ApplicableNames(*task, held),
              ElementsAre("place(hook,table)", "place(hook,shelf)", "push(hook,box,table)"));
  EXPECT_FALSE(task->FindAction("place(hook,hook)").valid());
}

/// Along every reachable state, the ground task and the lifted semantics agree: on what holds, on which
/// actions apply in which order, on the goal, and on formulas compiled later.
void ExpectSameSemantics(const std::shared_ptr<const Problem>& problem, size_t max_states) {
  const auto task = Task::Ground(problem);
  std::set<naive::Facts> seen;
  std::deque<std::pair<State, naive::Facts>> queue;
  queue.push_back({task->initial_state(), naive::Initial(*problem)});
  seen.insert(queue.front().second);
  const Condition goal = task->Compile(problem->goal);
  for (size_t count = 0; !queue.empty() && count < max_states; ++count) {
    const auto [state, facts] = queue.front();
    queue.pop_front();
    std::vector<std::string> atoms, names;
    for (const Atom& atom : facts) atoms.push_back(task->AtomName(atom));
    ASSERT_EQ(task->TrueAtoms(state, true), atoms);
    ASSERT_EQ(task->IsGoal(state), naive::Holds(*problem, problem->goal, facts, {}));
    ASSERT_EQ(goal.Holds(state), task->IsGoal(state));
    for (const naive::Step& step : naive::Steps(*problem, facts)) {
      names.push_back(step.name);
      const ActionId action = task->FindAction(step.name);
      ASSERT_TRUE(action.valid()) << step.name;
      if (seen.insert(step.after).second) queue.push_back({task->Apply(action, state), step.after});
    }
    ASSERT_EQ(ApplicableNames(*task, state), names);
  }
}

TEST(TaskTest, AgreesWithTheNaiveSemanticsOnShippedProblems) {
  ExpectSameSemantics(Shipped("workspace_reach"), 1000);
  ExpectSameSemantics(Shipped("hanoi"), 1000);
}

TEST(TaskTest, AgreesWithTheNaiveSemanticsOnRandomProblems) {
  for (uint64_t seed = 0; seed < 1000; ++seed) {
    const naive::RandomProblem random(seed);
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + random.domain() + random.problem());
    ExpectSameSemantics(ParseProblem(random.problem(), "p", ParseDomain(random.domain(), "d")), 40);
    if (HasFatalFailure()) return;
  }
}

TEST(TaskTest, DerivedPredicatesAgreeWithTheNaiveSemantics) {
  for (uint64_t seed = 0; seed < 600; ++seed) {
    const naive::RandomProblem random(seed, {.costs = false, .derived = true});
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + random.domain() + random.problem());
    ExpectSameSemantics(ParseProblem(random.problem(), "p", ParseDomain(random.domain(), "d")), 40);
    if (HasFatalFailure()) return;
  }
}

TEST(TaskTest, CostsAreExactMultiplesOfAUnit) {
  const auto domain = ParseDomain(
      "(define (domain d) (:predicates (at ?x)) (:functions (total-cost) (far ?a ?b) - number)\n"
      "(:action go :parameters (?a ?b) :precondition (at ?a)\n :effect (and (at ?b) (not (at ?a))"
      " (increase (total-cost) (+ (far ?a ?b) 0.2)))))",
      "d");
  const std::string begin = "(define (problem x) (:domain d) (:objects a b) (:init (at a) (= (total-cost) 0)";
  const std::string end = ") (:goal (at b)) (:metric minimize (total-cost)))";
  const std::string all = "(= (far a b) 0.3) (= (far b a) 1) (= (far a a) 0) (= (far b b) 0)";
  const auto task = Task::Ground(ParseProblem(begin + all + end, "p", domain));
  EXPECT_DOUBLE_EQ(task->cost_unit(), 0.1);
  EXPECT_EQ(task->actions()[task->FindAction("go(a,b)")].cost, 5);
  EXPECT_EQ(task->actions()[task->FindAction("go(b,a)")].cost, 12);
  const auto without = Task::Ground(ParseProblem(begin + ") (:goal (at b)))", "p", domain));
  EXPECT_EQ(without->actions()[ActionId(0)].cost, 1) << "no metric: each action costs 1";
  try {
    Task::Ground(ParseProblem(begin + end, "p", domain));
    FAIL();
  } catch (const InputError& error) {
    ASSERT_EQ(error.diagnostics().size(), 4u);
    EXPECT_EQ(error.diagnostics()[0].ToString(),
              "d:3:63: the cost of go(a,a) needs the value of (far a a) (give it in ':init': (= "
              "(far a a) "
              "number))");
  }
}

TEST(TaskTest, CostsAreExactToTheSixthDigitAfterThePoint) {
  const std::string domain =
      "(define (domain d) (:predicates (a) (b)) (:functions (total-cost) (toll) - number)\n"
      "(:action cheap :parameters () :effect (and (a) (increase (total-cost) 1.000001)))\n"
      "(:action dear :parameters () :effect (and (a) (increase (total-cost) 1.000002)))\n"
      "(:action paid :parameters () :effect (and (b) (increase (total-cost) (toll)))))";
  const auto ground = [&](const std::string& toll) {
    const auto parsed = ParseDomain(domain, "d");
    return Task::Ground(ParseProblem("(define (problem x) (:domain d) (:init (= (total-cost) 0) (= (toll) " +
                                         toll + ")) (:goal (a)) (:metric minimize (total-cost)))",
                                     "p", parsed));
  };
  const auto cost = [](const Task& task, const std::string& action) {
    return std::lround(1e6 * task.cost_unit() *
                       static_cast<double>(task.actions()[task.FindAction(action)].cost));
  };
  const auto task = ground("0.000009");
  EXPECT_EQ(cost(*task, "cheap()"), 1000001);
  EXPECT_EQ(cost(*task, "dear()"), 1000002);
  EXPECT_EQ(cost(*task, "paid()"), 9);
  EXPECT_EQ(cost(*ground("999999999.999999"), "paid()"), 999999999999999);
  EXPECT_EQ(cost(*ground("0.0000090"), "paid()"), 9) << "zeros at the end are no digits";
  try {
    ground("0.0000095");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("up to six digits after the point"));
  }
  const auto problem =
      ParseProblem("(define (problem x) (:domain d) (:init (= (toll) 0.000009)) (:goal (b)))", "p",
                   ParseDomain(domain, "d"));
  EXPECT_THAT(WriteDomain(*problem->domain), ::testing::HasSubstr("(increase (total-cost) 1.000001)"));
  EXPECT_THAT(WriteProblem(*problem), ::testing::HasSubstr("0.000009"));
}

TEST(TaskTest, CompetitionDomainsGround) {
  EXPECT_EQ(Task::Ground(domains::Blocks8())->actions().size(), 144u);
  EXPECT_EQ(Task::Ground(domains::Gripper(4))->actions().size(), 36u);
  EXPECT_EQ(Task::Ground(domains::Logistics6())->actions().size(), 84u);
  EXPECT_EQ(Task::Ground(domains::Depot())->actions().size(), 90u);
}

TEST(TaskTest, DeletesBeforeItAddsAndReadsConditionsBefore) {
  const auto domain = ParseDomain(
      "(define (domain d) (:predicates (p) (q) (r))"
      "(:action swap :effect (and (p) (not (p)) (when (p) (not (q))) (when (q) (r)) (when (not (p)) (q)))))",
      "d");
  const auto task =
      Task::Ground(ParseProblem("(define (problem x) (:domain d) (:init (p) (q)) (:goal (r)))", "p", domain));
  EXPECT_THAT(task->TrueAtoms(task->Apply(ActionId(0), task->initial_state()), true),
              ElementsAre("p()", "r()"));
}

TEST(TaskTest, ManyAtomsUseManyWords) {
  std::string objects, init;
  for (int i = 0; i < 200; ++i) objects += " o" + std::to_string(i);
  const auto domain = ParseDomain(
      "(define (domain d) (:predicates (on ?x))"
      "(:action flip :parameters (?x) :precondition (not (on ?x)) :effect (on ?x))"
      "(:action off :parameters (?x) :precondition (on ?x) :effect (not (on ?x))))",
      "d");
  const auto task = Task::Ground(ParseProblem("(define (problem x) (:domain d) (:objects" + objects +
                                                  ") (:init (on o77)) (:goal (forall (?x) (on ?x))))",
                                              "p", domain));
  ASSERT_EQ(task->words(), 4u);
  State state = task->initial_state();
  for (int i = 0; i < 200; ++i) {
    EXPECT_FALSE(task->IsGoal(state) && i < 199);
    if (i != 77) state = task->Apply(task->FindAction("flip(o" + std::to_string(i) + ")"), state);
  }
  EXPECT_TRUE(task->IsGoal(state));
}

TEST(TaskTest, ReplacesTheGoal) {
  const auto problem = WithGoal(*Shipped("workspace_reach"), "(exists (?m - movable) (inhand ?m))", {});
  const auto task = Task::Ground(problem);
  EXPECT_FALSE(task->IsGoal(task->initial_state()));
  EXPECT_TRUE(task->IsGoal(task->Apply(task->FindAction("pick(hook)"), task->initial_state())));
}

std::vector<std::string> Variables(int count) {
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) names.push_back("?v" + std::to_string(i));
  return names;
}

/// A chain of nodes over a sparse relation that never changes, from a visited one to another, quantified in
/// a precondition, a condition of an effect, a derived predicate or the goal.
std::shared_ptr<const Problem> Chain(int length, int nodes, const std::string& place) {
  const std::vector<std::string> names = Variables(length);
  std::string variables, body = "(and (seen ?v0) (seen " + names.back() + ")";
  for (size_t i = 0; i < names.size(); ++i) {
    variables += " " + names[i];
    if (i > 0) body += " (road " + names[i - 1] + " " + names[i] + ")";
  }
  const std::string exists = "(exists (" + variables + " - node) " + body + "))";
  std::string domain =
      "(define (domain d) (:types node) (:predicates (road ?x ?y - node) (seen ?x - node) "
      "(linked) (done))\n (:action see :parameters (?x - node) :effect (seen ?x))\n";
  if (place == "precondition") domain += "(:action end :precondition " + exists + " :effect (done))";
  if (place == "effect") domain += "(:action end :effect (when " + exists + " (done)))";
  if (place == "axiom") {
    domain += "(:derived (linked) " + exists + ")";
    domain += "(:action end :precondition (linked) :effect (done))";
  }
  // The same with `forall`: no chain is missing an end.
  if (place == "forall") {
    domain += "(:action end :precondition (not (forall (" + variables + " - node) (not " + body +
              ")))) :effect (done))";
  }
  std::string objects, facts;
  for (int i = 0; i < nodes; ++i) {
    objects += " n" + std::to_string(i);
    for (int k : {2 * i + 1, 5 * i + 3})
      facts += " (road n" + std::to_string(i) + " n" + std::to_string(k % nodes) + ")";
  }
  return ParseProblem("(define (problem p) (:domain d) (:objects" + objects + " - node) (:init" + facts +
                          ") (:goal " + (place == "goal" ? exists : "(done)") + "))",
                      "p", ParseDomain(domain + ")", "d"));
}

// Find exists_join.
TEST(TaskTest, ExistsJoin_QuantifiedConditionsAreJoinedOverFacts) {
  for (const std::string place : {"precondition", "effect", "axiom", "forall", "goal"}) {
    SCOPED_TRACE(place);
    // 40⁶ bindings would not be written out in time.
    Limits limits;
    limits.SetTimeLimit(60);
    const auto task = Task::Ground(Chain(6, 40, place), limits);
    EXPECT_EQ(task->actions().size(), place == "goal" ? 40u : 41u);
    // With few nodes, the same as the expanded formula.
    const auto small = Chain(4, 4, place);
    const auto grounded = Task::Ground(small);
    State state = grounded->initial_state();
    naive::Facts facts = naive::Initial(*small);
    Random random(7);
    for (int step = 0; step < 12; ++step) {
      const auto steps = naive::Steps(*small, facts);
      ASSERT_EQ(ApplicableNames(*grounded, state).size(), steps.size());
      ASSERT_EQ(grounded->IsGoal(state), naive::Holds(*small, small->goal, facts, {}));
      const naive::Step& next = steps[random.Index(static_cast<int>(steps.size()))];
      state = grounded->Apply(grounded->FindAction(next.name), state);
      facts = next.after;
    }
  }
}

TEST(TaskTest, GroundingKeepsToItsLimits) {
  std::string objects;
  for (int i = 0; i < 100; ++i) objects += " o" + std::to_string(i);
  const auto domain = ParseDomain(
      "(define (domain d) (:predicates (p ?a ?b))\n (:action huge :parameters (?a ?b ?c ?d ?e ?f)"
      " :precondition (p ?e ?f) :effect (p ?a ?b)))",
      "d.pddl");
  const auto problem = ParseProblem(
      "(define (problem x) (:domain d) (:objects" + objects + ") (:init (p o1 o2)) (:goal (p o1 o3)))", "p",
      domain);
  std::atomic<bool> stop{true};
  const auto reached = [&](const Limits& limits) -> std::optional<Limit> {
    try {
      Task::Ground(problem, limits);
    } catch (const LimitReached& error) {
      return error.limit();
    }
    return std::nullopt;
  };
  EXPECT_EQ(reached({.deadline = std::chrono::steady_clock::now()}), Limit::kTime);
  EXPECT_EQ(reached({.interrupted = &stop}), Limit::kInterrupted);
  if (MemoryInUse() > 0) {
    EXPECT_EQ(reached({.memory = MemoryInUse() + (size_t{16} << 20)}), Limit::kMemory);
  }
}

}  // namespace
}  // namespace tether::symbolic
