#include "tether/symbolic/pddl/pddl.h"

#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/symbolic/naive.h"
#include "tether/common/document/value.h"
#include "tether/common/file.h"
#include "tether/common/random.h"

namespace tether::symbolic {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const char* const kGood = R"((define (domain tower)
  (:requirements :strips :typing)
  (:types thing - object  block plate - thing)
  (:constants Left Right - plate)
  (:predicates (on ?a - block ?b - thing) (clear ?a - thing))
  (:action move
    :parameters (?a - block ?from ?to - thing)
    :precondition (and (on ?a ?from) (clear ?a) (clear ?to) (not (= ?a ?to)))
    :effect (and (on ?a ?to) (not (on ?a ?from)) (clear ?from) (not (clear ?to)))))
)";

/// The lines of the error that `parse` throws.
std::vector<std::string> Mistakes(const std::function<void()>& parse) {
  std::vector<std::string> lines;
  try {
    parse();
  } catch (const InputError& error) {
    for (const Diagnostic& diagnostic : error.diagnostics()) lines.push_back(diagnostic.ToString());
  }
  return lines;
}

std::vector<std::string> DomainMistakes(const std::string& text) {
  return Mistakes([&] { ParseDomain(text, "d"); });
}

std::vector<std::string> ProblemMistakes(const std::string& text) {
  return Mistakes([&] { ParseProblem(text, "p", ParseDomain(kGood, "d")); });
}

TEST(PddlTest, KeepsSpellingAndIgnoresCase) {
  const auto domain = ParseDomain(kGood, "d");
  const auto problem = ParseProblem(
      "(DEFINE (Problem x) (:Domain TOWER) (:Objects boxA - BLOCK) (:INIT (ON BOXA left)) (:goal (On boxa "
      "RIGHT)))",
      "p", domain);
  EXPECT_EQ(WriteFormula(problem->goal, *domain, problem->objects), "(on boxA Right)");
  EXPECT_EQ(problem->FindObject("BOXA"), 2);
  ASSERT_EQ(problem->init.size(), 1u);
  EXPECT_EQ(problem->init[0].where.ToString(), "p:1:68");
}

TEST(PddlTest, WritingAndReadingChangesNothing) {
  auto check = [](const std::string& domain_text, const std::string& problem_text) {
    const auto domain = ParseDomain(domain_text, "d");
    const auto problem = ParseProblem(problem_text, "p", domain);
    const std::string domain_again = WriteDomain(*domain), problem_again = WriteProblem(*problem);
    const auto again = ParseProblem(problem_again, "p", ParseDomain(domain_again, "d"));
    EXPECT_EQ(WriteDomain(*again->domain), domain_again);
    EXPECT_EQ(WriteProblem(*again), problem_again);
    // The same ground task too, so that nothing is lost in writing.
    const auto one = Task::Ground(problem), two = Task::Ground(again);
    EXPECT_EQ(one->atoms(), two->atoms());
    ASSERT_EQ(one->actions().size(), two->actions().size());
    for (size_t i = 0; i < one->actions().size(); ++i)
      EXPECT_EQ(one->actions()[ActionId(i)].name, two->actions()[ActionId(i)].name);
  };
  for (const char* name : {"hanoi", "workspace_reach"}) {
    const std::string folder = std::string(TETHER_SOURCE_DIR) + "/scenarios/" + name;
    check(ReadFile(folder + "/domain.pddl"), ReadFile(folder + "/problem.pddl"));
  }
  for (uint64_t seed = 0; seed < 300; ++seed) {
    const naive::RandomProblem random(seed);
    check(random.domain(), random.problem());
    const naive::RandomProblem more(seed, {.costs = true, .derived = true});
    check(more.domain(), more.problem());
  }
}

TEST(PddlTest, EitherMeansAnyOfTheTypes) {
  const auto domain = ParseDomain(
      "(define (domain d) (:types a b c) (:predicates (p ?x - (either a b)))"
      "(:action go :parameters (?x - (either b c)) :effect (and)))",
      "d");
  EXPECT_EQ(domain->TypeText(domain->predicates[0].parameters[0].types), "(either a b)");
  EXPECT_TRUE(domain->Fits({1}, domain->predicates[0].parameters[0].types));
  EXPECT_FALSE(
      domain->Fits(domain->actions[0].parameters[0].types, domain->predicates[0].parameters[0].types));
}

TEST(PddlTest, SaysWhereAClosingParenthesisIsTooMany) {
  // The shape of a published problem file: the goal's list is closed one line too early.
  EXPECT_THAT(
      ProblemMistakes(
          "(define (problem x)\n\t(:domain tower)\n\t(:objects a - block)\n\t(:init (on a left))\n"
          "\t(:goal (or\n\t\t(on a right)\n\t))\n\t)\n)\n"),
      ElementsAre("p:9:1: one ')' too many: '(define' of p:1:1 is already closed by the ')' of p:8:2"));
}

TEST(PddlTest, SaysWhereAClosingParenthesisIsMissing) {
  EXPECT_THAT(
      DomainMistakes("(define (domain d)\n  (:predicates (p)\n  (:action a\n    :effect (p)))\n"),
      ElementsAre("d:3:3: a ')' is missing before '(:action': '(:predicates' of d:2:3 is not closed"));
  EXPECT_THAT(DomainMistakes("(define (domain d)\n (:predicates (p))"),
              ElementsAre("d:2:19: a ')' is missing at the end: '(define' of d:1:1 is not closed"));
  EXPECT_THAT(DomainMistakes("(define (domain d)\n (:predicates (p)"),
              ElementsAre("d:2:18: 2 ')' are missing at the end: '(:predicates' of d:2:2 is not closed"));
}

TEST(PddlTest, RefusesDeepNestingAndStrangeText) {
  EXPECT_THAT(DomainMistakes(std::string(100000, '(')),
              ElementsAre("d:1:257: parentheses are nested more than 256 deep"));
  EXPECT_THAT(DomainMistakes("(define (domain d) [ \x01)"),
              ElementsAre(HasSubstr("d:1:20: unexpected '['"), HasSubstr("d:1:22: unexpected byte 1")));
  EXPECT_THAT(DomainMistakes(""),
              ElementsAre("d:1:1: there is no domain in this file (accepted: (define (domain name) …))"));
  EXPECT_THAT(DomainMistakes("(define (problem x))"),
              ElementsAre(HasSubstr("d:1:9: this defines a 'problem', not a domain")));
}

TEST(PddlTest, ReportsEveryMistakeOfADomain) {
  EXPECT_THAT(
      DomainMistakes("(define (domain tower)\n"
                     "  (:requirements :strips :typng :fluents)\n"
                     "  (:types block - thin thing)\n"
                     "  (:constants left Left - thing)\n"
                     "  (:predicates (on ?a - block ?a - thing) (clear ?a))\n"
                     "  (:functions (total-cost) - numbr)\n"
                     "  (:acton move)\n"
                     "  (:action move :parameters (?a - blok ?b)\n"
                     "    :precondition (and (onn ?a ?b) (clear ?c) (clear left right) (clear a))\n"
                     "    :efect (and)))\n"),
      ElementsAre(
          "d:3:19: unknown type 'thin' (did you mean 'thing'? accepted: object, block or thing)",
          "d:6:30: a function's values are numbers, not 'numbr' (accepted: - number; functions with objects "
          "as "
          "values are not supported)",
          HasSubstr("d:7:3: unknown section ':acton' (did you mean ':action'?"),
          "d:8:35: unknown type 'blok' (did you mean 'block'? accepted: object, block or thing)",
          HasSubstr("d:9:25: unknown predicate 'onn' (did you mean 'on'? accepted: on, clear, and, or, not"),
          "d:9:43: unknown variable '?c' (did you mean '?a'? accepted: ?a or ?b)",
          "d:9:47: 'clear' has 2 arguments, not 1 (accepted: (clear ?a - object))",
          "d:9:59: unknown object 'right' (accepted: left)",
          "d:9:73: unknown object 'a' (did you mean '?a'? accepted: ?a)",
          HasSubstr("d:10:5: unknown keyword ':efect' in action 'move' (did you mean ':effect'?")));
}

TEST(PddlTest, ReportsEveryMistakeOfAProblem) {
  EXPECT_THAT(
      ProblemMistakes("(define (problem x)\n"
                      "  (:domain towel)\n"
                      "  (:objects a b - block A - block left - plate)\n"
                      "  (:init (on a lefft) (on left a) (on a) (and (clear a)) (= (total-cost) 0))\n"
                      "  (:goal (and (clear a) (clear c)) (clear b))\n"
                      "  (:metric minimize (total-cost)))"),
      ElementsAre(
          "p:2:12: the problem is for domain 'towel', but d defines 'tower'",
          HasSubstr("p:4:16: unknown object 'lefft' (did you mean 'Left'?"),
          "p:4:27: 'left' is of type 'plate', but argument 1 of 'on' must be 'block' (accepted: (on ?a - "
          "block ?b - thing))",
          "p:4:35: 'on' has 1 argument, not 2 (accepted: (on ?a - block ?b - thing))",
          "p:4:42: ':init' holds facts, not formulas (accepted: (predicate object …))",
          "p:5:3: ':goal' holds 2 formulas, not 1 (accepted: (:goal formula))"));
  EXPECT_THAT(
      ProblemMistakes("(define (problem x) (:objects a - block))"),
      ElementsAre("p:1:1: the problem has no '(:domain …)'", "p:1:1: the problem has no '(:goal …)'"));
}

TEST(PddlTest, NamesWhatIsNotSupported) {
  EXPECT_THAT(
      DomainMistakes(
          "(define (domain d) (:predicates (p))\n (:action a :effect (and (p) (increase (total-cost) 1)))\n"
          " (:action b :precondition (> (fuel) 1) :effect (not (and (p))))\n"
          " (:action c :precondition (when (p) (p)) :effect (or (p)))\n"
          " (:durative-action x) (:action e :effect (decrease (fuel) 2)) (:action f :precondition (= (fuel) "
          "2)))"),
      ElementsAre("d:3:27: '(> …)': numeric fluents are not supported",
                  HasSubstr("d:3:53: an effect can negate only a predicate, not '(and …)'"),
                  HasSubstr("d:4:27: '(when …)' is an effect, not a formula"),
                  HasSubstr("d:4:50: '(or …)' is not an effect"),
                  "d:5:2: ':durative-action': durative actions are not supported",
                  "d:5:42: '(decrease …)': numeric fluents are not supported, except costs (accepted: "
                  "(increase (total-cost) …))",
                  "d:5:91: '(fuel)' is not a variable or object (functions are not supported)"));
}

TEST(PddlTest, CostsAndDerivedPredicatesAreChecked) {
  EXPECT_THAT(
      DomainMistakes("(define (domain d) (:requirements :action-costs :derived-predicates) (:predicates (p "
                     "?a) (q ?a) (r))\n"
                     " (:functions (total-cost) (dist ?a) - number)\n"
                     " (:derived (q ?a) (p ?a)) (:derived (q ?a ?b) (r)) (:derived (s) (r))\n"
                     " (:action a :parameters (?a) :effect (and (increase (total-cost) -1) (increase "
                     "(total-cost) (dst ?a))))\n"
                     " (:action b :parameters (?a) :effect (when (p ?a) (increase (total-cost) 1)))\n"
                     " (:action c :parameters (?a) :effect (and (q ?a) (increase (dist ?a) 1))))"),
      ElementsAre(
          HasSubstr("d:3:37: 'q' has 2 parameters here, not 1"), HasSubstr("d:3:63: unknown predicate 's'"),
          HasSubstr("d:4:66: the cost is '-1' (accepted: a number from 0"),
          HasSubstr("d:4:93: '(dst …)' is not a cost (accepted: a number, (+ …), or a function: did you mean "
                    "'dist'?"),
          HasSubstr("d:5:51: the cost of an action can't depend on the state"),
          "d:6:43: '(q …)': an effect can't change a derived predicate",
          HasSubstr("d:6:60: '(increase (dist …)': numeric fluents are not supported")));
  EXPECT_THAT(DomainMistakes(
                  "(define (domain d) (:predicates (p) (q))\n (:derived (p) (not (q))) (:derived (q) (p)))"),
              ElementsAre(HasSubstr("d:2:12: derived predicate 'p' depends on its own negation")));
  const auto domain = ParseDomain(
      "(define (domain d) (:predicates (p) (q)) (:functions (total-cost) (f)) (:derived (p) (q)))", "d");
  EXPECT_THAT(
      Mistakes([&] {
        ParseProblem(
            "(define (problem x) (:domain d) (:init (p) (= (f) x) (= (g) 1) (= (f) 1) (= (f) 2) (at 3 (q)))\n"
            "(:goal (q)) (:metric maximize (total-cost)))",
            "p", domain);
      }),
      ElementsAre(
          "p:1:40: ':init' can't give 'p', which is derived", HasSubstr("p:1:51: the value of 'f' is 'x'"),
          HasSubstr("p:1:57: unknown function 'g'"), HasSubstr("p:1:64: this value is given twice"),
          HasSubstr("p:1:74: this value is given twice"), "p:1:84: timed initial literals are not supported",
          HasSubstr("p:2:13: only the total cost of actions can be minimised")));
}

TEST(PddlTest, TypesMustNotFormACycle) {
  EXPECT_THAT(DomainMistakes("(define (domain d) (:types a - b b - a))"),
              ElementsAre("d:1:28: type 'a' is above itself"));
}

TEST(PddlTest, GoalsGivenApartKeepTheirPlace) {
  const auto problem =
      ParseProblem("(define (problem x) (:domain tower) (:objects a - block) (:goal (clear a)))", "p",
                   ParseDomain(kGood, "d"));
  const auto changed = WithGoal(*problem, "(or (on a left)\n (on a right))", {"s.yaml", 7, 20});
  EXPECT_EQ(WriteFormula(changed->goal, *changed->domain, changed->objects), "(or (on a Left) (on a Right))");
  EXPECT_THAT(Mistakes([&] {
                WithGoal(*problem, "(or (on a lef)\n (onn a right))", {"s.yaml", 7, 20});
              }),
              ElementsAre(HasSubstr("s.yaml:7:30: unknown object 'lef'"),
                          HasSubstr("s.yaml:8:3: unknown predicate 'onn'")));
  EXPECT_THAT(Mistakes([&] {
                WithGoal(*problem, "(on a left)) ", {"s.yaml", 0, 0});
              }),
              ElementsAre(HasSubstr("s.yaml:1:12: one ')' too many")));
  EXPECT_THAT(Mistakes([&] {
                WithGoal(*problem, "  ", {"s.yaml", 7, 20});
              }),
              ElementsAre(HasSubstr("s.yaml:7:20: the goal is empty")));
}

TEST(PddlTest, MutatedFilesParseOrSayWhy) {
  const std::string folder = std::string(TETHER_SOURCE_DIR) + "/scenarios/workspace_reach";
  const std::string texts[2] = {ReadFile(folder + "/domain.pddl"), ReadFile(folder + "/problem.pddl")};
  const std::vector<std::string> pieces = {
      "(", ")",      "-", "?a", "forall", "(and", "not",    "(= ?a ?b)", ":action", "object",
      " ", "either", ";", "()", "((",     "\n",   ":types", "when",      "box",     "movable"};
  Random random(11);
  int good = 0;
  for (int round = 0; round < 4000; ++round) {
    std::string mutated[2] = {texts[0], texts[1]};
    for (int k = 1 + random.Index(4); k > 0; --k) {
      std::string& text = mutated[random.Index(2)];
      const auto at = static_cast<size_t>(random.Index(static_cast<int>(text.size())));
      const auto length = static_cast<size_t>(random.Index(12));
      switch (random.Index(5)) {
        case 0:
          text.erase(at, length);
          break;
        case 1:
          text.insert(at, pieces[random.Index(static_cast<int>(pieces.size()))]);
          break;
        case 2:
          text[at] = static_cast<char>(random.Index(256));
          break;
        case 3:
          text.insert(at, text.substr(random.Index(static_cast<int>(text.size())), length * 4));
          break;
        default:
          text.resize(at);
          break;
      }
      if (text.empty()) text = " ";
    }
    try {
      const auto problem = ParseProblem(mutated[1], "p", ParseDomain(mutated[0], "d"));
      Task::Ground(problem);
      ++good;
    } catch (const InputError& error) {
      ASSERT_FALSE(error.diagnostics().empty());
      for (const Diagnostic& diagnostic : error.diagnostics()) {
        ASSERT_FALSE(diagnostic.message.empty());
        ASSERT_GT(diagnostic.where.line, 0) << diagnostic.ToString();
        ASSERT_GT(diagnostic.where.column, 0) << diagnostic.ToString();
      }
    }
  }
  EXPECT_GT(good, 50);
}

}  // namespace
}  // namespace tether::symbolic
