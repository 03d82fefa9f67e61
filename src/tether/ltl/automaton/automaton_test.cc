#include "tether/ltl/automaton/automaton.h"

#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/ltl/random_formula.h"
#include "tether/ltl/formula/evaluate.h"
#include "tether/ltl/formula/parser.h"

namespace tether::ltl {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr const char* kAssistive =
    "F(in(pen,person) & in(book,person)) & F(in(meat,heat) & X F(in(meat,person) & in(salad,person))) & "
    "F(in(book,book_place) & in(pen,pen_place))";

Automaton Build(const std::string& text, Semantics semantics = Semantics::kCosafe) {
  return *BuildAutomaton(ParseFormula(text), semantics);
}

/// Every set of true atoms.
std::vector<Letter> AllLetters(size_t atoms) {
  std::vector<Letter> letters;
  for (uint64_t bits = 0; bits < 1ull << atoms; ++bits) letters.push_back({bits});
  return letters;
}

/// Classes of states that no word tells apart, by plain refinement over all letters.
size_t CountClasses(const Automaton& automaton) {
  const std::vector<Letter> letters = AllLetters(automaton.atoms().size());
  std::vector<int> class_of;
  for (int s = 0; s < automaton.states(); ++s) class_of.push_back(automaton.IsAccepting(s) ? 1 : 0);
  for (size_t before = 0;;) {
    std::map<std::vector<int>, int> classes;
    std::vector<int> next;
    for (int s = 0; s < automaton.states(); ++s) {
      std::vector<int> key{class_of[s]};
      for (const Letter& letter : letters) key.push_back(class_of[automaton.Step(s, letter)]);
      next.push_back(classes.emplace(key, static_cast<int>(classes.size())).first->second);
    }
    class_of = next;
    if (classes.size() == before) return before;
    before = classes.size();
  }
}

TEST(Automaton, TasksInAnyOrderHaveThreeToTheirNumberStates) {
  int states = 1;
  for (int n = 1; n <= 6; ++n) {
    states *= 3;
    EXPECT_EQ(Build(testing::TwoStepTasks(n)).states(), states);
    EXPECT_EQ(Build(testing::TwoStepTasks(n), Semantics::kLtlf).states(), states);
  }
}

TEST(Automaton, PaperBHasTwelveStates) {
  const Automaton automaton = Build(kAssistive);
  EXPECT_EQ(automaton.states(), 12);
  EXPECT_EQ(CountClasses(automaton), 12u);
  EXPECT_EQ(automaton.distance(0), 2);
  EXPECT_TRUE(automaton.IsSatisfiable());
}

TEST(Automaton, SmallOnesAreAsByHand) {
  EXPECT_EQ(Build("true").states(), 1);
  EXPECT_EQ(Build("false").states(), 1);
  EXPECT_EQ(Build("F a").states(), 2);
  EXPECT_EQ(Build("a").states(), 3);  // not yet, accepted, lost
  EXPECT_EQ(Build("X a").states(), 4);
  EXPECT_EQ(Build("G a", Semantics::kLtlf).states(), 2);
  EXPECT_EQ(Build("G F a", Semantics::kLtlf).states(), 2);  // was a true last? The empty word is accepted
  EXPECT_EQ(Build("G(a -> F b)", Semantics::kLtlf).states(), 2);
  EXPECT_EQ(Build("F G a", Semantics::kLtlf).states(), 2);
}

TEST(Automaton, AgreesWithTheDefinitionOfLtlf) {
  Random random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    const Formula formula = testing::RandomFormula(random, random.Index(10), 3, false);
    const auto automaton = BuildAutomaton(formula, Semantics::kLtlf);
    ASSERT_TRUE(automaton.has_value());
    for (size_t k = 0; k < 30; ++k) {
      const Word word = testing::RandomWord(random, k % 7, formula.atoms().size());
      ASSERT_EQ(automaton->Accepts(word), Evaluate(formula, word, Semantics::kLtlf))
          << formula.ToString() << " on a word of length " << word.size();
    }
  }
}

TEST(Automaton, AgreesWithTheDefinitionOfCosafe) {
  Random random(2);
  for (int trial = 0; trial < 2000; ++trial) {
    const Formula formula = testing::RandomFormula(random, random.Index(12), 3, true);
    const auto automaton = BuildAutomaton(formula, Semantics::kCosafe);
    ASSERT_TRUE(automaton.has_value());
    for (size_t k = 0; k < 30; ++k) {
      const Word word = testing::RandomWord(random, k % 7, formula.atoms().size());
      ASSERT_EQ(automaton->Accepts(word), Evaluate(formula, word, Semantics::kCosafe))
          << formula.ToString() << " on a word of length " << word.size();
    }
  }
}

TEST(Automaton, NoTwoStatesAreEquivalent) {
  Random random(3);
  for (int trial = 0; trial < 600; ++trial) {
    const bool cosafe = trial % 2 == 0;
    const Formula formula = testing::RandomFormula(random, random.Index(12), 3, cosafe);
    const auto automaton = BuildAutomaton(formula, cosafe ? Semantics::kCosafe : Semantics::kLtlf);
    EXPECT_EQ(CountClasses(*automaton), static_cast<size_t>(automaton->states())) << formula.ToString();
  }
}

TEST(Automaton, EqualLanguagesHaveEqualAutomata) {
  const std::pair<const char*, const char*> pairs[] = {{"F a & F b", "F(a & F b) | F(F a & b)"},
                                                       {"a U b", "!!(a U b) | b | a & X[!](a U b)"},
                                                       {"G a", "!F !a"},
                                                       {"a W b", "a U b | G a"},
                                                       {"a M b", "a & b | b U (a & b)"},
                                                       {"a R b", "!(!a U !b)"},
                                                       {"X a", "!X[!] !a"},
                                                       {"a xor b", "!(a <-> b)"}};
  for (const auto& [left, right] : pairs) {
    const Automaton a = Build(left, Semantics::kLtlf), b = Build(right, Semantics::kLtlf);
    ASSERT_EQ(a.atoms(), b.atoms());
    EXPECT_EQ(a.states(), b.states()) << left;
    EXPECT_EQ(a.diagram().roots, b.diagram().roots) << left;
    EXPECT_EQ(a.diagram().accepting, b.diagram().accepting) << left;
  }
}

TEST(Automaton, GoodPrefixesStayGood) {
  Random random(4);
  for (int trial = 0; trial < 500; ++trial) {
    const Formula formula = testing::RandomFormula(random, random.Index(12), 3, true);
    const auto automaton = BuildAutomaton(formula, Semantics::kCosafe);
    for (int s = 0; s < automaton->states(); ++s) {
      EXPECT_EQ(automaton->IsAccepting(s), automaton->IsSettled(s)) << formula.ToString();
    }
  }
}

TEST(Automaton, DistancesAreShortestWords) {
  Random random(5);
  for (int trial = 0; trial < 300; ++trial) {
    const Formula formula = testing::RandomFormula(random, random.Index(12), 3, false);
    const Automaton automaton = *BuildAutomaton(formula, Semantics::kLtlf);
    const std::vector<Letter> letters = AllLetters(formula.atoms().size());
    for (int s = 0; s < automaton.states(); ++s) {
      int best = Automaton::kNever;
      for (const Letter& letter : letters)
        best = std::min(best, automaton.distance(automaton.Step(s, letter)));
      const int expected = automaton.IsAccepting(s) ? 0 : best == Automaton::kNever ? best : best + 1;
      ASSERT_EQ(automaton.distance(s), expected) << formula.ToString();
    }
  }
}

TEST(Automaton, UnsatisfiableFormulasAreRecognised) {
  for (const char* text : {"false", "a & !a", "F(a & !a)", "a U false", "F a & (!a U false)", "X(b & !b)"}) {
    EXPECT_FALSE(Build(text).IsSatisfiable()) << text;
  }
  for (const char* text : {"F a & G !a", "G X[!] true", "G false", "a & G(a -> X[!] a)"}) {
    EXPECT_FALSE(Build(text, Semantics::kLtlf).IsSatisfiable()) << text;
  }
  for (const char* text : {"true", "G X a", "G a", "F a", "X false"}) {
    EXPECT_TRUE(Build(text, Semantics::kLtlf).IsSatisfiable()) << text;
  }
}

TEST(Automaton, EdgesPartitionTheLetters) {
  Random random(6);
  for (int trial = 0; trial < 200; ++trial) {
    const Formula formula = testing::RandomFormula(random, random.Index(12), 3, false);
    const Automaton automaton = *BuildAutomaton(formula, Semantics::kLtlf);
    const std::vector<Letter> letters = AllLetters(formula.atoms().size());
    std::vector<std::vector<int>> targets(static_cast<size_t>(automaton.states()) * letters.size());
    for (const AutomatonEdge& edge : automaton.Edges()) {
      for (size_t i = 0; i < letters.size(); ++i) {
        const auto holds = [&](const auto& literal) {
          return IsTrue(letters[i], literal.first) == literal.second;
        };
        const bool open = std::any_of(edge.guard.begin(), edge.guard.end(), [&](const Cube& cube) {
          return std::all_of(cube.literals.begin(), cube.literals.end(), holds);
        });
        const bool all = std::all_of(edge.clauses.begin(), edge.clauses.end(), [&](const Cube& clause) {
          return std::any_of(clause.literals.begin(), clause.literals.end(), holds);
        });
        ASSERT_EQ(open, all);
        if (open) targets[static_cast<size_t>(edge.from) * letters.size() + i].push_back(edge.to);
      }
    }
    for (int s = 0; s < automaton.states(); ++s) {
      for (size_t i = 0; i < letters.size(); ++i) {
        ASSERT_THAT(targets[static_cast<size_t>(s) * letters.size() + i],
                    ElementsAre(automaton.Step(s, letters[i])));
      }
    }
  }
}

TEST(Automaton, GuardsAreShort) {
  const Automaton automaton = Build("F(a & X[!] F b)");
  std::vector<std::string> lines;
  for (const AutomatonEdge& edge : automaton.Edges()) {
    lines.push_back(std::to_string(edge.from) + " -> " + std::to_string(edge.to) + ": " +
                    GuardText(edge, automaton.atoms()));
  }
  EXPECT_THAT(lines, ElementsAre("0 -> 0: !a", "0 -> 1: a", "1 -> 1: !b", "1 -> 2: b", "2 -> 2: true"));
}

TEST(Automaton, GuardsAreFactoredWhereThatIsShorter) {
  std::vector<std::string> texts;
  const Automaton automaton = Build("F(a & b) & F(c & d)");
  for (const AutomatonEdge& edge : automaton.Edges()) {
    const std::string text = GuardText(edge, automaton.atoms());
    texts.push_back(text);
    EXPECT_NO_THROW(ParseFormula(text));
  }
  EXPECT_THAT(texts, ElementsAre("(!a | !b) & (!c | !d)", "(!a | !b) & c & d", "a & b & (!c | !d)",
                                 "a & b & c & d", "!a | !b", "a & b", "!c | !d", "c & d", "true"));
}

TEST(Automaton, RelevantAtomsAreThoseThatCount) {
  const Automaton automaton = Build("F(a & X[!] F b)");
  EXPECT_THAT(automaton.RelevantAtoms(0), ElementsAre(0));
  EXPECT_THAT(automaton.RelevantAtoms(1), ElementsAre(1));
  EXPECT_THAT(automaton.RelevantAtoms(2), IsEmpty());
}

TEST(Automaton, LimitsAreKept) {
  EXPECT_FALSE(BuildAutomaton(ParseFormula(testing::TwoStepTasks(8)), Semantics::kCosafe, {1000, 1'000'000}));
  EXPECT_FALSE(BuildAutomaton(ParseFormula(testing::TwoStepTasks(8)), Semantics::kCosafe, {100'000, 1000}));
  EXPECT_FALSE(
      BuildAutomaton(ParseFormula("F(" + testing::TwoStepTasks(8) + ")"), Semantics::kCosafe, {500}));
}

TEST(Automaton, ManyAtomsAreNoObstacle) {
  std::string any, all;
  for (int i = 0; i < 200; ++i) {
    any += (i > 0 ? " | a" : "a") + std::to_string(i);
    all += (i > 0 ? " & a" : "a") + std::to_string(i);
  }
  EXPECT_EQ(Build("F(" + any + ")").states(), 2);
  EXPECT_EQ(Build("F(" + all + ")").states(), 2);
  Letter letter(LetterWords(200));
  EXPECT_EQ(Build("F(" + any + ")").Step(0, letter), 0);
  letter[3] = 1u << 7;  // a199
  EXPECT_EQ(Build("F(" + any + ")").Step(0, letter), 1);
}

}  // namespace
}  // namespace tether::ltl
