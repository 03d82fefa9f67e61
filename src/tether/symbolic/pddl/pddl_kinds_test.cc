// PDDL as people write it: what is odd and has one meaning is accepted with a warning; the rest says what is
// meant. Tests are named after docs/finds.md.

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/symbolic/grounding/task.h"
#include "tether/symbolic/pddl/pddl.h"

namespace tether::symbolic {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> Texts(const std::vector<Diagnostic>& diagnostics) {
  std::vector<std::string> texts;
  for (const Diagnostic& diagnostic : diagnostics) texts.push_back(diagnostic.ToString());
  return texts;
}

std::vector<std::string> Warnings(const std::string& domain) {
  return Texts(ParseDomain(domain, "d")->warnings);
}

std::vector<std::string> Mistakes(const std::string& domain) {
  try {
    ParseDomain(domain, "d");
  } catch (const InputError& error) {
    return Texts(error.diagnostics());
  }
  return {};
}

std::shared_ptr<const Problem> Parse(const std::string& domain, const std::string& problem) {
  return ParseProblem(problem, "p", ParseDomain(domain, "d"));
}

TEST(PddlKindsTest, IpcLogistics00_NamesInADeclarationMeanNothing) {
  const std::string text =
      "(define (domain d) (:predicates (near ?place ?place) (dist ?a ?b ?a))\n"
      " (:functions (cost ?x ?x))\n"
      " (:action go :parameters (?a ?b) :precondition (near ?a ?b) :effect (near ?b ?a)))";
  const auto domain = ParseDomain(text, "d");
  EXPECT_EQ(domain->predicates[0].parameters.size(), 2u);
  EXPECT_EQ(domain->predicates[1].parameters.size(), 3u);
  EXPECT_EQ(domain->functions[0].parameters.size(), 2u);
  EXPECT_THAT(Texts(domain->warnings),
              ElementsAre("d:1:46: parameter '?place' is declared twice: they are taken for two",
                          "d:1:66: parameter '?a' is declared twice: they are taken for two",
                          "d:2:23: parameter '?x' is declared twice: they are taken for two"));
  // Elsewhere names have a meaning.
  EXPECT_THAT(Mistakes("(define (domain d) (:predicates (p)) (:action a :parameters (?x ?x) :effect (p)))"),
              ElementsAre("d:1:65: variable '?x' is declared twice"));
  // What a declaration can't mean makes no follow-up errors.
  EXPECT_THAT(Mistakes("(define (domain d) (:predicates (p x)) (:action a :parameters (?x) :effect (p ?x)))"),
              ElementsAre("d:1:36: 'x' is not a variable (accepted: a name that begins with '?')"));
}

TEST(PddlKindsTest, IpcZenotravel_AVariableEndsTheNameBeforeIt) {
  const auto domain = ParseDomain(
      "(define (domain d) (:predicates (boat?b) (near?a?b)) (:action sail :parameters (?a?b)\n"
      " :precondition (boat?a) :effect (near?a ?b)))",
      "d");
  EXPECT_EQ(domain->predicates[1].parameters.size(), 2u);
  EXPECT_EQ(domain->actions[0].parameters.size(), 2u);
  EXPECT_EQ(domain->actions[0].precondition.predicate, 0);
  EXPECT_THAT(Texts(domain->warnings),
              ElementsAre("d:1:38: a space is missing between 'boat' and the variable after it",
                          "d:1:47: a space is missing between 'near' and the variable after it",
                          "d:1:49: a space is missing between '?a' and the variable after it"));
}

TEST(PddlKindsTest, IpcStorage_ATypeMayBeListedAgainWhereThatIsStillATree) {
  const auto domain = ParseDomain(
      "(define (domain d) (:types crane pad yard - object yard box - pad pad - pad0 pad0 small - object\n"
      " small - pad small - box) (:predicates (p ?x - pad0)))",
      "d");
  EXPECT_TRUE(domain->IsSubtype(domain->FindType("yard"), domain->FindType("pad")));
  EXPECT_TRUE(domain->IsSubtype(domain->FindType("small"), domain->FindType("box")));
  EXPECT_TRUE(domain->IsSubtype(domain->FindType("yard"), domain->FindType("pad0")));
  EXPECT_FALSE(domain->IsSubtype(domain->FindType("crane"), domain->FindType("pad")));
  EXPECT_THAT(Texts(domain->warnings),
              testing::Contains("d:1:52: type 'yard' is declared twice; first at d:1:38"));
  EXPECT_THAT(Mistakes("(define (domain d) (:types a b - object c - a c - b))"),
              ElementsAre("d:1:51: type 'c' is below 'a' and 'b' (a type has one type above it, and those "
                          "above that)"));
  EXPECT_THAT(Mistakes("(define (domain d) (:types a - b b - a a - c c - object))"), testing::Not(IsEmpty()));
  EXPECT_THAT(
      Warnings("(define (domain d) (:types truck - vehicle))"),
      ElementsAre("d:1:36: type 'vehicle' is not declared itself: it is taken for one below 'object'"));
}

TEST(PddlKindsTest, PddlstreamUndeclared_TotalCostIsKnownAndNamesMayHaveAt) {
  const std::string domain =
      "(define (domain d) (:constants @home) (:predicates (At ?o ?s) (#spot ?s))\n"
      " (:action carry :parameters (?o ?s ?t) :precondition (and (At ?o ?s) (#spot ?t))\n"
      "  :effect (and (At ?o ?t) (not (At ?o ?s)) (increase (total-cost) 2)))\n"
      " (:action wait :effect (increase (total-cost) 1)))";
  const auto problem =
      Parse(domain,
            "(define (problem p) (:domain d) (:objects cup a@b) (:init (At cup @home) (#spot a@b)\n"
            " (= (total-cost) 0)) (:goal (At cup a@b)) (:metric minimize (total-cost)))");
  EXPECT_THAT(
      Texts(problem->domain->warnings),
      ElementsAre("d:3:54: ':functions' does not declare 'total-cost' ((:functions (total-cost) - number))"));
  EXPECT_THAT(Texts(problem->warnings), ElementsAre(HasSubstr("does not declare 'total-cost'")));
  const auto task = Task::Ground(problem);
  const ActionId carry = task->FindAction("carry(cup,@home,a@b)");
  ASSERT_TRUE(carry.valid());
  EXPECT_EQ(static_cast<double>(task->actions()[carry].cost) * task->cost_unit(), 2);
  // Other functions must be declared.
  EXPECT_THAT(
      Mistakes("(define (domain d) (:predicates (p)) (:action a :effect (increase (total-cost) (f))))"),
      ElementsAre(HasSubstr("'(f)' is not a cost")));
}

TEST(PddlKindsTest, Bom_AByteOrderMarkIsSkipped) {
  const std::string domain = "\xEF\xBB\xBF(define (domain d) (:predicates (p)))";
  EXPECT_THAT(Warnings(domain), IsEmpty());
  EXPECT_NO_THROW(Parse(domain, "\xEF\xBB\xBF; a comment\n(define (problem p) (:domain d) (:goal (p)))"));
  EXPECT_THAT(Mistakes("\xEF\xBB\xBF(define (domain d) (:predicate (p)))"),
              ElementsAre(HasSubstr("d:1:20: ")));
  EXPECT_THAT(Mistakes(std::string("\xFF\xFE(\0d\0", 6)),
              ElementsAre("d:1:1: the file is in UTF-16 (accepted: UTF-8)"));
}

TEST(PddlKindsTest, ObjectsDeclaredTwiceAreOneIfTheirTypesAllowIt) {
  const std::string domain =
      "(define (domain d) (:types box crate - thing thing pad) (:constants x - thing X - box))";
  const auto problem = Parse(
      domain, "(define (problem p) (:domain d) (:objects x - thing y - crate y - crate) (:goal (and)))");
  EXPECT_EQ(problem->objects.size(), 2u);
  EXPECT_EQ(problem->domain->TypeText(problem->objects[0].types), "box");
  EXPECT_THAT(Texts(problem->warnings), ElementsAre("p:1:43: object 'x' is declared twice; first at d:1:69",
                                                    HasSubstr("object 'y' is declared twice")));
  EXPECT_THROW(Parse(domain, "(define (problem p) (:domain d) (:objects x - pad) (:goal (and)))"),
               InputError);
}

TEST(PddlKindsTest, RequirementsAreNoReasonToRefuseWhatNeedsNothingOfThem) {
  EXPECT_THAT(Warnings("(define (domain d) (:requirements :strips :typng :fluents :ucpop))"),
              ElementsAre(HasSubstr("d:1:43: requirement ':typng' is unknown (did you mean ':typing'?"),
                          "d:1:50: requirement ':fluents' is not supported",
                          HasSubstr("d:1:59: requirement ':ucpop' is unknown")));
  EXPECT_THAT(Mistakes("(define (domain d) (:requirements :durative-actions) (:durative-action a))"),
              ElementsAre("d:1:54: ':durative-action': durative actions are not supported"));
}

TEST(PddlKindsTest, OddProblemsOfOldCompetitions) {
  const auto problem = Parse("(define (domain d) (:predicates (p)) (:action a :parameters () :effect (p)))",
                             "(define (problem p) (:domain d) (:objects) (:init) (:goal (and))\n"
                             " (:length (:serial 3) (:parallel 3)) (:metric minimize (total-time)))");
  EXPECT_FALSE(problem->minimize_cost);
  EXPECT_THAT(Texts(problem->warnings),
              ElementsAre(HasSubstr("p:2:38: actions have no durations here: their number is minimised")));
}

TEST(PddlKindsTest, Messages_AnUnknownTypeIsSaidOnceAndHasNoConsequences) {
  EXPECT_THAT(
      Mistakes(
          "(define (domain d) (:types box) (:predicates (on ?a - bocks ?b - box) (p ?x - bocks))\n"
          " (:action a :parameters (?a - bocks ?b - box) :precondition (and (on ?a ?b) (on ?b ?b) (p ?b))\n"
          " :effect (p ?a)))"),
      ElementsAre("d:1:55: unknown type 'bocks' (accepted: object or box)"));
}

TEST(PddlKindsTest, Messages_WhatIsMeantIsSaid) {
  EXPECT_THAT(Mistakes("(define (domain d) (:types room) (:predicates (p ?r -room)))"),
              ElementsAre("d:1:53: a space is missing after the '-' of '-room' (accepted: - room)"));
  EXPECT_THAT(Mistakes("(define (domain d) (:predicates (p ?a)) (:derived (not (p ?a)) (and)))"),
              ElementsAre(HasSubstr("d:1:51: a rule can't say where a predicate does not hold")));
}

}  // namespace
}  // namespace tether::symbolic
