#include "tether/symbolic/grounding/mutex.h"

#include <algorithm>
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

std::vector<State> Reachable(const Task& task, size_t max_states) {
  std::set<State> seen = {task.initial_state()};
  std::vector<State> states = {task.initial_state()};
  std::vector<ActionId> actions;
  for (size_t i = 0; i < states.size() && states.size() < max_states; ++i) {
    task.FindApplicable(states[i], actions);
    for (const ActionId action : actions) {
      const State next = task.Apply(action, states[i]);
      if (seen.insert(next).second) states.push_back(next);
    }
  }
  return states;
}

bool Holds(const State& state, int literal) {
  const auto atom = static_cast<size_t>(literal / 2);
  return ((state[atom / 64] >> (atom % 64) & 1) != 0) == (literal % 2 == 0);
}

/// No reachable state has both literals of a mutex, or breaks a variable; returns how many mutexes there are.
int ExpectSound(const Task& task, size_t max_states) {
  const auto mutexes = Mutexes::Find(task);
  EXPECT_TRUE(mutexes.has_value());
  if (!mutexes) return 0;
  const std::vector<Variable> variables = FindVariables(task, *mutexes);
  const int literals = 2 * static_cast<int>(task.atoms().size());
  int count = 0;
  for (int a = 0; a < literals; ++a) {
    for (int b = 0; b < literals; ++b) {
      count += (a ^ 1) != b && mutexes->AreMutex(a, b);
      EXPECT_EQ(mutexes->AreMutex(a, b), mutexes->AreMutex(b, a));
    }
  }
  for (const State& state : Reachable(task, max_states)) {
    for (int a = 0; a < literals; ++a) {
      for (int b = 0; Holds(state, a) && b < literals; ++b) {
        if (!Holds(state, b) || !mutexes->AreMutex(a, b)) continue;
        ADD_FAILURE() << a << " and " << b;
        return count;
      }
    }
    for (const Variable& variable : variables) {
      const auto holding = std::count_if(variable.atoms.begin(), variable.atoms.end(),
                                         [&](int atom) { return Holds(state, Literal(atom, true)); });
      EXPECT_LE(holding, 1);
      EXPECT_TRUE(holding == 1 || !variable.exactly_one);
    }
  }
  return count;
}

TEST(MutexTest, NoReachableStateHasBothOfAPair) {
  int found = 0;
  for (uint64_t seed = 0; seed < 3000; ++seed) {
    const naive::RandomProblem random(seed, {.costs = false, .derived = seed % 3 == 0});
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + random.domain() + random.problem());
    found += ExpectSound(
        *Task::Ground(ParseProblem(random.problem(), "p", ParseDomain(random.domain(), "d"))), 300);
    if (HasFailure()) return;
  }
  EXPECT_GT(found, 1000);
}

std::vector<std::string> Text(const Task& task, const std::vector<Variable>& variables) {
  std::vector<std::string> texts;
  for (const Variable& variable : variables) {
    std::string text = variable.exactly_one ? "one of" : "at most one of";
    for (int atom : variable.atoms) text += " " + task.AtomName(task.atoms()[atom]);
    texts.push_back(text);
  }
  return texts;
}

TEST(MutexTest, VariablesOfKnownDomains) {
  const auto gripper = Task::Ground(domains::Gripper(2));
  EXPECT_GT(ExpectSound(*gripper, 10'000), 0);
  EXPECT_THAT(Text(*gripper, FindVariables(*gripper, *Mutexes::Find(*gripper))),
              testing::UnorderedElementsAre(
                  "one of at-robby(rooma) at-robby(roomb)",
                  "one of at(ball1,rooma) at(ball1,roomb) carry(ball1,left) carry(ball1,right)",
                  "one of at(ball2,rooma) at(ball2,roomb) carry(ball2,left) carry(ball2,right)",
                  "one of free(left) carry(ball1,left) carry(ball2,left)",
                  "one of free(right) carry(ball1,right) carry(ball2,right)"));
  for (const auto& problem : {domains::Blocks4(), domains::Logistics4(), domains::Depot()}) {
    EXPECT_GT(ExpectSound(*Task::Ground(problem), 2000), 0);
  }
}

/// Two carts on a line can't pass each other; exchanged, they are in the other order.
TEST(MutexTest, HoldsForWhatPermutationsMakeOfTheStart) {
  const char* const domain =
      R"((define (domain line) (:predicates (at ?c ?p) (full ?p) (cart ?c) (next ?p ?q))
    (:action slide :parameters (?c ?p ?q)
      :precondition (and (cart ?c) (at ?c ?p) (not (full ?q)) (or (next ?p ?q) (next ?q ?p)))
      :effect (and (not (at ?c ?p)) (not (full ?p)) (at ?c ?q) (full ?q)))))";
  const auto task = Task::Ground(ParseProblem(
      "(define (problem p) (:domain line) (:objects a b p q r s) (:init (cart a) (cart b) (next p q) (next q "
      "r) (next r s) (at a p) (at b q) (full p) (full q)) (:goal (at a r)))",
      "p", ParseDomain(domain, "d")));
  const int a = task->problem().FindObject("a"), b = task->problem().FindObject("b");
  AtomPermutation exchange;
  for (Atom atom : task->atoms()) {
    for (int& object : atom.arguments) object = object == a ? b : object == b ? a : object;
    exchange.push_back(task->FindAtom(atom));
  }
  const auto clashes = [&](const Mutexes& mutexes) {
    for (const State& state : Reachable(*task, 1000)) {
      for (size_t i = 0; i < exchange.size(); ++i) {
        for (size_t k = 0; k < exchange.size(); ++k) {
          const int first = static_cast<int>(i), second = static_cast<int>(k);
          if (Holds(state, Literal(first, true)) && Holds(state, Literal(second, true)) &&
              mutexes.AreMutex(Literal(exchange[i], true), Literal(exchange[k], true)))
            return true;
        }
      }
    }
    return false;
  };
  EXPECT_TRUE(clashes(*Mutexes::Find(*task)));
  EXPECT_FALSE(clashes(*Mutexes::Find(*task, {exchange})));
  EXPECT_THAT(Text(*task, FindVariables(*task, *Mutexes::Find(*task, {exchange}), {exchange})),
              testing::IsSupersetOf(
                  {"one of at(a,p) at(a,q) at(a,r) at(a,s)", "one of at(b,p) at(b,q) at(b,r) at(b,s)"}));
}

TEST(MutexTest, GivesUpBeforeItTakesLong) {
  EXPECT_FALSE(Mutexes::Find(*Task::Ground(domains::Blocks10()), {}, 1000).has_value());
}

}  // namespace
}  // namespace tether::symbolic
