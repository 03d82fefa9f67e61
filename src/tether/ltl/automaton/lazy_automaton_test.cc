#include "tether/ltl/automaton/lazy_automaton.h"

#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/ltl/random_formula.h"
#include "tether/ltl/formula/evaluate.h"
#include "tether/ltl/formula/parser.h"

namespace tether::ltl {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr LazyOptions kProgressOnly{1, 1};

LazyAutomaton Make(const std::string& text, Semantics semantics = Semantics::kCosafe,
                   const LazyOptions& options = {}) {
  return LazyAutomaton(ParseFormula(text), semantics, options);
}

/// Steps under every letter until nothing is new; the states.
int Explore(LazyAutomaton& automaton) {
  for (int s = 0; s < automaton.states(); ++s) {
    for (uint64_t letter = 0; letter < 1ull << automaton.atoms().size(); ++letter) automaton.Step(s, letter);
  }
  return automaton.states();
}

TEST(LazyAutomaton, TasksInAnyOrderHaveThreeToTheirNumberStates) {
  for (const LazyOptions& options : {LazyOptions{}, kProgressOnly}) {
    int states = 1;
    for (int n = 1; n <= 5; ++n) {
      states *= 3;
      LazyAutomaton automaton = Make(testing::TwoStepTasks(n), Semantics::kCosafe, options);
      EXPECT_EQ(Explore(automaton), states);
      EXPECT_EQ(automaton.parts(), n);
      EXPECT_EQ(automaton.PartAutomaton(0) == nullptr, options.max_part_states == 1);
    }
  }
}

TEST(LazyAutomaton, ProgressedPartsAreFiniteAndNeverSmallerThanMinimal) {
  LazyAutomaton automaton =
      Make("F(" + testing::TwoStepTasks(2) + ") & c0", Semantics::kCosafe, kProgressOnly);
  EXPECT_EQ(automaton.parts(), 2);
  const auto minimal =
      BuildAutomaton(ParseFormula("F(" + testing::TwoStepTasks(2) + ") & c0"), Semantics::kCosafe);
  EXPECT_GE(Explore(automaton), minimal->states());
}

TEST(LazyAutomaton, OnlyVisitedStatesAreBuilt) {
  LazyAutomaton automaton = Make(testing::TwoStepTasks(12));
  EXPECT_EQ(automaton.states(), 1);
  int state = automaton.initial();
  for (int i = 0; i < 24; ++i) state = automaton.Step(state, uint64_t{1} << i);
  EXPECT_TRUE(automaton.IsSettled(state));
  EXPECT_EQ(automaton.states(), 25);
}

TEST(LazyAutomaton, AgreesWithTheDefinition) {
  Random random(1);
  for (int trial = 0; trial < 1500; ++trial) {
    const bool cosafe = trial % 2 == 0;
    const Semantics semantics = cosafe ? Semantics::kCosafe : Semantics::kLtlf;
    const Formula formula = testing::RandomFormula(random, random.Index(12), 4, cosafe);
    LazyAutomaton compiled(formula, semantics), progressed(formula, semantics, kProgressOnly);
    for (size_t k = 0; k < 20; ++k) {
      const Word word = testing::RandomWord(random, k % 7, formula.atoms().size());
      const bool expected = Evaluate(formula, word, semantics);
      for (LazyAutomaton* automaton : {&compiled, &progressed}) {
        int state = automaton->initial();
        for (const Letter& letter : word) state = automaton->Step(state, letter);
        ASSERT_EQ(automaton->IsAccepting(state), expected) << formula.ToString();
      }
    }
  }
}

TEST(LazyAutomaton, BoundsAreAdmissibleAndConsistent) {
  Random random(2);
  for (int trial = 0; trial < 400; ++trial) {
    const bool cosafe = trial % 2 == 0;
    const Semantics semantics = cosafe ? Semantics::kCosafe : Semantics::kLtlf;
    const Formula formula = testing::RandomFormula(random, random.Index(10), 3, cosafe);
    for (const LazyOptions& options : {LazyOptions{}, kProgressOnly}) {
      LazyAutomaton automaton(formula, semantics, options);
      Explore(automaton);
      for (int s = 0; s < automaton.states(); ++s) {
        EXPECT_EQ(automaton.LowerBound(s) == 0, automaton.IsAccepting(s));
        for (uint64_t letter = 0; letter < 1ull << automaton.atoms().size(); ++letter) {
          const int next = automaton.Step(s, letter);
          ASSERT_LE(automaton.LowerBound(s), std::min(LazyAutomaton::kNever, automaton.LowerBound(next) + 1))
              << formula.ToString();
          if (automaton.IsSettled(s) || automaton.IsTrap(s)) {
            EXPECT_EQ(next, s);
          }
        }
      }
    }
  }
}

TEST(LazyAutomaton, OtherAtomsThanTheRelevantDoNotCount) {
  Random random(3);
  for (int trial = 0; trial < 300; ++trial) {
    const Formula formula = testing::RandomFormula(random, random.Index(12), 5, false);
    for (const LazyOptions& options : {LazyOptions{}, kProgressOnly}) {
      LazyAutomaton automaton(formula, Semantics::kLtlf, options);
      int state = automaton.initial();
      for (int k = 0; k < 10; ++k) {
        uint64_t relevant = 0;
        for (int atom : automaton.RelevantAtoms(state)) relevant |= uint64_t{1} << atom;
        const uint64_t letter = random.Next();
        const int next = automaton.Step(state, letter);
        ASSERT_EQ(next, automaton.Step(state, letter & relevant)) << formula.ToString();
        ASSERT_EQ(next, automaton.Step(state, letter | ~relevant)) << formula.ToString();
        state = next;
      }
    }
  }
}

TEST(LazyAutomaton, ContradictionsBetweenConjunctsAreSeenAtOnce) {
  EXPECT_TRUE(Make("F(a & b) & G !a", Semantics::kLtlf).IsTrap(0));
  EXPECT_TRUE(Make("F a & F(b & !b)").IsTrap(0));
  LazyAutomaton automaton = Make("F a & F b & !c U b");
  EXPECT_EQ(automaton.parts(), 2);
  const int lost = automaton.Step(0, 0b100);
  EXPECT_TRUE(automaton.IsTrap(lost));
  EXPECT_EQ(automaton.Step(lost, 0b11), lost);
  EXPECT_THAT(automaton.RelevantAtoms(lost), IsEmpty());
}

TEST(LazyAutomaton, PartsAreThoseOfPaperB) {
  LazyAutomaton automaton = Make("F(pp & bp) & F(mh & X F(mp & sp)) & F(bb & pb)");
  ASSERT_EQ(automaton.parts(), 3);
  EXPECT_EQ(automaton.PartAutomaton(0)->states(), 2);
  EXPECT_EQ(automaton.PartAutomaton(1)->states(), 3);
  EXPECT_EQ(automaton.PartAutomaton(2)->states(), 2);
  EXPECT_THAT(automaton.RelevantAtoms(0), ElementsAre(0, 1, 2, 5, 6));
  EXPECT_EQ(automaton.LowerBound(0), 2);
  const int heated = automaton.Step(0, 1 << 2);
  EXPECT_EQ(automaton.PartState(heated, 0), 0);
  EXPECT_EQ(automaton.PartState(heated, 1), 1);
  EXPECT_THAT(automaton.RelevantAtoms(heated), ElementsAre(0, 1, 3, 4, 5, 6));
  EXPECT_EQ(Explore(automaton), 12);
}

TEST(LazyAutomaton, MoreThan64Atoms) {
  std::string text;
  for (int i = 0; i < 100; ++i) text += (i > 0 ? " & F a" : "F a") + std::to_string(i);
  LazyAutomaton automaton = Make(text);
  EXPECT_EQ(automaton.letter_words(), 2u);
  int state = 0;
  for (size_t i = 0; i < 100; ++i) {
    Letter letter(2);
    letter[i / 64] = uint64_t{1} << (i % 64);
    EXPECT_FALSE(automaton.IsAccepting(state));
    state = automaton.Step(state, letter);
  }
  EXPECT_TRUE(automaton.IsAccepting(state));
}

}  // namespace
}  // namespace tether::ltl
