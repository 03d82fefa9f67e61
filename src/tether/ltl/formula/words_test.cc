// Words that other tools for LTLf read as operators; tests are named after docs/finds.md.

#include "tether/ltl/formula/words.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/ltl/automaton/automaton.h"
#include "tether/ltl/formula/parser.h"

namespace tether::ltl {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Formula Read(const std::string& text) { return ReadEnds(ParseFormula(text), Semantics::kLtlf); }

std::string Mistake(const std::string& text) {
  try {
    ParseFormula(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(WordsTest, LtlLastEnd_MeanTheEndOfTheWord) {
  EXPECT_EQ(Read("F(a & last)"), ParseFormula("F(a & !X[!] true)"));
  EXPECT_EQ(Read("G(b -> X end | last)"), ParseFormula("G(b -> X G false | !X[!] true)"));
  EXPECT_EQ(Read("F(last & (a | b)) & F a").atoms(), (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(BuildAutomaton(Read("F(a & last)"), Semantics::kLtlf)->atoms(), std::vector<std::string>{"a"});
  // In quotes it is a name, and others than the whole word are too.
  EXPECT_EQ(Read("F(\"last\" & last)").atoms(), std::vector<std::string>{"last"});
  EXPECT_EQ(Read("F \"last\"").ToString(), "F \"last\"");
  EXPECT_EQ(Read("F last(a) & F endless").atoms(), (std::vector<std::string>{"last(a)", "endless"}));
}

TEST(WordsTest, LtlLastEnd_UnderCosafeItIsAPropositionAndSaysSo) {
  const Formula formula = ParseFormula("F(a & last)");
  EXPECT_EQ(ReadEnds(formula, Semantics::kCosafe), formula);
  const auto warnings = WordWarnings(formula, Semantics::kCosafe);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].ToString(),
            "formula:1:7: 'last' is a proposition here: under 'cosafe' words have no end (for the end of the "
            "word, the semantics 'ltlf')");
  EXPECT_THAT(WordWarnings(formula, Semantics::kLtlf), IsEmpty());
}

TEST(WordsTest, LtlLastEnd_OperatorsOfOtherNotationsAreSuggested) {
  EXPECT_THAT(Mistake("always a"),
              HasSubstr("formula:1:8: unexpected 'a' where an operator is expected (did you "
                        "mean 'G' for 'always'? "));
  EXPECT_THAT(Mistake("eventually (a & b)"),
              HasSubstr("'&' among the arguments of 'eventually' (did you mean 'F' for 'eventually'? "));
  EXPECT_THAT(Mistake("b & not a"), HasSubstr("did you mean '!' for 'not'? "));
  EXPECT_THAT(Mistake("WX a"), HasSubstr("did you mean 'X' for 'WX'? "));
  EXPECT_THAT(Mistake("N a"), HasSubstr("did you mean 'X' for 'N'? "));
  EXPECT_THAT(Mistake("WX (a | b)"), HasSubstr("'|' among the arguments of 'WX'"));
  EXPECT_THAT(Mistake("at red hall"), HasSubstr("did you mean 'at(red,hall)'? "));
  EXPECT_THAT(Mistake("F (in cup tray)"), HasSubstr("did you mean 'in(cup,tray)'? "));
  EXPECT_THAT(Mistake("a until b"), HasSubstr("did you mean 'U'? "));
}

TEST(WordsTest, LtlLastEnd_AnAtomThatLooksLikeAnOperatorIsSaid) {
  const Formula formula = ParseFormula("eventually(a) & F always(b, c) & \"not(a)\"");
  std::vector<std::string> texts;
  for (const Diagnostic& warning : WordWarnings(formula, Semantics::kCosafe))
    texts.push_back(warning.ToString());
  EXPECT_THAT(texts,
              ElementsAre("formula:1:1: 'eventually(a)' is a proposition here (for the operator, write F; in "
                          "double quotes it is meant)",
                          HasSubstr("formula:1:19: 'always(b,c)' is a proposition here (for the operator, "
                                    "write G;")));
}

TEST(WordsTest, ArgumentsAreNamesAsPddlHasThem) {
  EXPECT_EQ(ParseFormula("F at(cup,@left)").atoms(), std::vector<std::string>{"at(cup,@left)"});
  EXPECT_EQ(AtomText("at(cup,#o1)"), "at(cup,#o1)");
}

}  // namespace
}  // namespace tether::ltl
