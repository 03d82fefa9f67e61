// Searches a PDDL task for action sequences, cheapest first; then the same task with a temporal goal in place
// of its own.

#include <cstdio>
#include <memory>

#include "tether/ltl/formula/parser.h"
#include "tether/symbolic/grounding/task.h"
#include "tether/symbolic/pddl/pddl.h"
#include "tether/task/search/skeleton.h"

namespace {

constexpr const char* kDomain = R"((define (domain blocks)
  (:requirements :strips)
  (:predicates (on ?a ?b) (free ?a) (held ?a) (empty))
  (:action pick :parameters (?a ?b)
    :precondition (and (on ?a ?b) (free ?a) (empty))
    :effect (and (held ?a) (free ?b) (not (on ?a ?b)) (not (free ?a)) (not (empty))))
  (:action place :parameters (?a ?b)
    :precondition (and (held ?a) (free ?b))
    :effect (and (on ?a ?b) (free ?a) (empty) (not (held ?a)) (not (free ?b))))))";

constexpr const char* kProblem = R"((define (problem two) (:domain blocks)
  (:objects red blue left middle right)
  (:init (on red left) (on blue middle) (free red) (free blue) (free right) (empty))
  (:goal (on red blue))))";

void Print(const tether::symbolic::Task& task, const tether::task::Skeleton& skeleton) {
  for (const tether::ActionId action : skeleton.actions)
    std::printf("%s ", task.actions()[action].name.c_str());
  std::printf("\n");
}

}  // namespace

int main() {
  using namespace tether;
  const auto task = symbolic::Task::Ground(
      symbolic::ParseProblem(kProblem, "problem", symbolic::ParseDomain(kDomain, "domain")));

  task::SkeletonSearch search(task);
  task::SearchOutcome outcome = search.Next();
  if (!outcome.found() || outcome.skeleton->actions.size() != 2) return 1;
  Print(*task, *outcome.skeleton);
  outcome = search.Next();  // The next cheapest.
  if (!outcome.found()) return 1;
  Print(*task, *outcome.skeleton);

  // Red on blue in some letter of the word, blue on the right in a later one.
  task::TemporalGoal goal{
      ltl::ParseFormula("F(on(red,blue) & X F on(blue,right))"), ltl::Semantics::kCosafe, {}};
  task::SkeletonSearch temporal(std::make_unique<task::Product>(task, goal));
  outcome = temporal.Next();
  if (!outcome.found()) return 1;
  Print(*task, *outcome.skeleton);
  // Blue goes first, red upon it; the fifth action is there because X asks for a letter after that.
  return outcome.skeleton->actions.size() == 5 ? 0 : 1;
}
