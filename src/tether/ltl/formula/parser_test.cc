#include "tether/ltl/formula/parser.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/ltl/random_formula.h"
#include "tether/common/random.h"
#include "tether/ltl/formula/cosafe.h"
#include "tether/ltl/formula/evaluate.h"

namespace tether::ltl {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::string Printed(const std::string& text) { return ParseFormula(text).ToString(); }

/// The message for a bad formula.
std::string Error(const std::string& text, const Location& where = {}) {
  try {
    ParseFormula(text, where);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Parser, BindsAsSpotDoes) {
  const std::pair<const char*, const char*> table[] = {
      {"a & b | c", "(a & b) | c"},
      {"a | b xor c", "a | (b xor c)"},
      {"a xor b & c", "a xor (b & c)"},
      {"a & b U c", "a & (b U c)"},
      {"F a U b", "(F a) U b"},
      {"!a U b", "(!a) U b"},
      {"X[!] a & b", "(X[!] a) & b"},
      {"G a -> F b", "(G a) -> (F b)"},
      {"a -> b -> c", "a -> (b -> c)"},
      {"a <-> b -> c", "a <-> (b -> c)"},
      {"a -> b <-> c", "a -> (b <-> c)"},
      {"a | b -> c & d", "(a | b) -> (c & d)"},
      {"a U b U c", "a U (b U c)"},
      {"a U b R c W d M e", "a U (b R (c W (d M e)))"},
      {"a xor b xor c", "(a xor b) xor c"},
      {"!F X a & b", "(!(F (X a))) & b"},
      {"a U F b U c", "a U ((F b) U c)"},
  };
  for (const auto& [text, meant] : table) EXPECT_EQ(ParseFormula(text), ParseFormula(meant)) << text;
  EXPECT_FALSE(ParseFormula("(a -> b) -> c") == ParseFormula("a -> b -> c"));
  EXPECT_FALSE(ParseFormula("(a U b) U c") == ParseFormula("a U b U c"));
}

TEST(Parser, SpellingsOfSpotAreAccepted) {
  const std::pair<const char*, const char*> table[] = {
      {"a && b /\\ c", "a & b & c"},
      {"a || b \\/ c", "a | b | c"},
      {"a => b", "a -> b"},
      {"a --> b", "a -> b"},
      {"a <=> b", "a <-> b"},
      {"a <--> b", "a <-> b"},
      {"a ^ b", "a xor b"},
      {"~a", "!a"},
      {"1 & 0", "true & false"},
      {"TRUE | False", "true | false"},
      {"<>a & []b", "F a & G b"},
      {"a V b", "a R b"},
      {"GFa", "G F a"},
      {"GF(a)", "G F a"},
      {"FXX[!]p0", "F X X[!] p0"},
      {"F0 & X12", "F0 & X12"},
      {"a->b", "a -> b"},
      {"aUb", "aUb"},
  };
  for (const auto& [text, printed] : table) EXPECT_EQ(Printed(text), printed) << text;
}

TEST(Parser, AtomsAreNamesPredicatesOrQuoted) {
  EXPECT_THAT(
      ParseFormula("F(on( box , shelf )) & \"in(meat, heat)\" & Free(a) & p() & pen-place & \"a b\" & a")
          .atoms(),
      ElementsAre("on(box,shelf)", "in(meat,heat)", "Free(a)", "p", "pen-place", "a b", "a"));
  EXPECT_EQ(Printed("\"on(box, shelf)\""), "on(box,shelf)");
  EXPECT_EQ(Printed("\"GFa\" & \"true\" & \"U\" & \"x\\\"y\\\\\""),
            "\"GFa\" & \"true\" & \"U\" & \"x\\\"y\\\\\"");
  EXPECT_EQ(ParseFormula("on(a,b) | on(a, b)").atoms(), std::vector<std::string>{"on(a,b)"});
}

TEST(Parser, PrintedFormulasReadBackEqual) {
  Random random(1);
  for (int trial = 0; trial < 3000; ++trial) {
    const Formula formula = testing::RandomFormula(random, random.Index(25), 5, false);
    const std::string text = formula.ToString();
    const Formula again = ParseFormula(text);
    ASSERT_EQ(again, formula) << text;
    ASSERT_EQ(again.ToString(), text);
    ASSERT_EQ(again.atoms(), formula.atoms());
  }
  EXPECT_EQ(Printed("((F((a) & (X[!](F(b))))))"), "F(a & X[!] F b)");
  EXPECT_EQ(Printed("a & (b & (c & d))"), "a & b & c & d");
}

TEST(Parser, ErrorsSayWhereAndWhat) {
  EXPECT_THAT(Error("F(a & )"),
              HasSubstr("formula:1:7: unexpected ')' where an operand of '&' is expected (accepted "
                        "here: an atom, true, false, '(' or one of the operators"));
  EXPECT_THAT(Error("F(a & b"), HasSubstr("formula:1:2: '(' has no closing ')'"));
  EXPECT_THAT(Error("F(a) & b)"), HasSubstr("formula:1:9: ')' has no opening '('"));
  EXPECT_THAT(Error(""), HasSubstr("formula:1:1: the formula is empty"));
  EXPECT_THAT(Error("  "), HasSubstr("the formula is empty"));
  EXPECT_THAT(Error("a U"), HasSubstr("formula:1:4: the formula ends where an operand of 'U' is expected"));
  EXPECT_THAT(Error("()"), HasSubstr("formula:1:2: unexpected ')' where a formula is expected after '('"));
  EXPECT_THAT(Error("a b"), HasSubstr("formula:1:3: unexpected 'b' where an operator is expected"));
  EXPECT_THAT(Error("a and b"),
              HasSubstr("formula:1:3: unexpected 'and' where an operator is expected (did you mean "
                        "'&'? accepted here: & | -> <-> xor U R W M, or the end of the formula)"));
  EXPECT_THAT(Error("(a until b)"), HasSubstr("did you mean 'U'?"));
  EXPECT_THAT(Error("U a"), HasSubstr("formula:1:1: unexpected 'U' where a formula is expected"));
  EXPECT_THAT(Error("X[3] a"), HasSubstr("formula:1:2: unexpected '[' (accepted: [!] right after X"));
  EXPECT_THAT(Error("a & 2b"), HasSubstr("formula:1:5: '2b' begins with a digit"));
  EXPECT_THAT(Error("a # b"), HasSubstr("formula:1:3: unexpected '#'"));
  EXPECT_THAT(Error("ä & ¬b"), HasSubstr("formula:1:1: unexpected 'ä'"));
  EXPECT_THAT(Error("\"ä\" & ¬b"), HasSubstr("formula:1:7: unexpected '¬'"));
  EXPECT_THAT(Error(std::string("a\x01")), HasSubstr("formula:1:2: unexpected control character"));
  EXPECT_THAT(Error("on(a, b"), HasSubstr("formula:1:1: 'on(' has no closing ')'"));
  EXPECT_THAT(Error("on(a,)"), HasSubstr("formula:1:6: an argument of 'on' is missing after ','"));
  EXPECT_THAT(Error("on(a & b)"),
              HasSubstr("formula:1:6: '&' among the arguments of 'on' (accepted: ',' or ')'; or is "
                        "an operator missing before '('?)"));
  EXPECT_THAT(Error("F \"a"), HasSubstr("formula:1:3: '\"' has no closing '\"'"));
  EXPECT_THAT(Error("\"\""), HasSubstr("formula:1:1: an empty name in quotes"));
}

TEST(Parser, ErrorsInFilesHaveTheirPlaceAndTheColumnOfTheFormula) {
  EXPECT_THAT(Error("F(a & )", {"scene.yaml", 12, 10}),
              HasSubstr("scene.yaml:12:10: column 7 of the formula: unexpected ')'"));
}

TEST(Parser, DeepNestingIsAnErrorNotACrash) {
  EXPECT_THAT(Error(std::string(100'000, '!') + "a"), HasSubstr("nested too deeply"));
  EXPECT_THAT(Error(std::string(100'000, '(')), HasSubstr("nested too deeply"));
  std::string chain = "a", conjunction = "a";
  for (int i = 0; i < 2000; ++i) {
    chain += " xor a";
    conjunction += " & a";
  }
  EXPECT_THAT(Error(chain), HasSubstr("nested too deeply"));
  EXPECT_EQ(Printed(conjunction), conjunction);
}

TEST(Parser, NoTextCrashes) {
  Random random(2);
  const std::string alphabet = "ab FGXURWM()[]!&|-<>=^~\"\\,01x.\n\x80\xc3\xff";
  const std::string start = "F(on(a,b) & X[!] F \"q r\") -> (a U b xor !c) W true";
  int formulas = 0;
  for (int trial = 0; trial < 20'000; ++trial) {
    std::string text;
    if (trial % 3 == 0) {
      for (int k = random.Index(30); k >= 0; --k) text += static_cast<char>(random.Index(256));
    } else if (trial % 3 == 1) {
      for (int k = random.Index(30); k >= 0; --k) text += alphabet[random.Index(std::ssize(alphabet))];
    } else {
      text = start;
      for (int k = random.Index(3); k >= 0; --k) {
        const auto at = static_cast<size_t>(random.Index(static_cast<int>(text.size())));
        const char c = alphabet[random.Index(static_cast<int>(alphabet.size()))];
        if (random.Index(2) == 0) text.erase(at, 1);
        if (random.Index(2) == 0) text.insert(at, 1, c);
      }
    }
    try {
      const Formula formula = ParseFormula(text);
      ++formulas;
      ASSERT_EQ(ParseFormula(formula.ToString()), formula) << text;
    } catch (const InputError& error) {
      ASSERT_THAT(error.diagnostics(), SizeIs(1));
      ASSERT_GE(error.diagnostics()[0].where.column, 1);
      ASSERT_LE(error.diagnostics()[0].where.column, static_cast<int>(text.size()) + 1);
      ASSERT_FALSE(error.diagnostics()[0].accepted.empty());
    }
  }
  EXPECT_GT(formulas, 1000);
}

TEST(Parser, UnknownPropositionsAreToldTogether) {
  const Formula formula = ParseFormula("F(in(meet,heat) & X F on(a,b)) & in(pen,heat) & F in(meet,heat)");
  try {
    RequireKnownAtoms(formula, {"in(meat,heat)", "in(pen,heat)"});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.diagnostics(), SizeIs(2));
    EXPECT_THAT(error.what(), HasSubstr("formula:1:3: unknown proposition 'in(meet,heat)' (did you mean "
                                        "'in(meat,heat)'? accepted: in(meat,heat) or in(pen,heat))"));
    EXPECT_THAT(error.what(), HasSubstr("formula:1:23: unknown proposition 'on(a,b)' (accepted: "));
  }
  EXPECT_NO_THROW(RequireKnownAtoms(formula, {"in(meet,heat)", "in(pen,heat)", "on(a,b)"}));
}

TEST(Cosafe, ViolationsAreInWordsWithTheirColumns) {
  const auto why = [](const std::string& text) {
    std::string all;
    for (const auto& violation : WhyNotCosafe(ParseFormula(text))) {
      all += std::to_string(violation.column) + ": " + violation.message + "\n";
    }
    return all;
  };
  EXPECT_THAT(why("F a & G !b"),
              HasSubstr("7: 'G' requires something at every position for ever; no finite word"));
  EXPECT_THAT(why("a R b"), HasSubstr("3: 'R' requires its right side for ever unless its left side comes"));
  EXPECT_THAT(why("a W b"), HasSubstr("3: 'W' may be satisfied by its left side for ever"));
  EXPECT_THAT(why("!(a & F b)"),
              HasSubstr("7: 'F' is negated by '!' at column 1, which requires that something never"));
  EXPECT_THAT(why("F a -> b"), HasSubstr("1: 'F' is negated by '->' at column 5"));
  EXPECT_THAT(why("F a <-> b"), HasSubstr("1: 'F' is negated by '<->' at column 5"));
  EXPECT_THAT(why("a xor X(b U c)"), HasSubstr("11: 'U' is negated by 'xor' at column 3"));
  for (const char* text : {"F(a & X F b)", "!G a", "!(a R b)", "!(a W b)", "G a -> F b", "!X a", "a <-> b",
                           "a M b", "X[!] a U !b", "!!F a", "a xor X b"}) {
    EXPECT_THAT(WhyNotCosafe(ParseFormula(text)), IsEmpty()) << text;
  }
  EXPECT_THAT(WhyNotCosafe(ParseFormula("G a & (b R c) & !F d")), SizeIs(3));
}

TEST(Cosafe, RequiringItThrowsWithAdvice) {
  try {
    RequireSemantics(ParseFormula("F a & G !b"), Semantics::kCosafe);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("formula:1:7: the formula is not co-safe: 'G' requires something"));
    EXPECT_THAT(error.what(), HasSubstr("or the semantics 'ltlf'"));
  }
  EXPECT_NO_THROW(RequireSemantics(ParseFormula("F a & G !b"), Semantics::kLtlf));
}

TEST(Cosafe, WhatIsNotCosafeIsNotMonotone) {
  // A formula that passes holds of every continuation of a word that it holds of.
  Random random(3);
  int cosafe = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const Formula formula = testing::RandomFormula(random, random.Index(8), 3, false);
    if (!WhyNotCosafe(formula).empty()) continue;
    ++cosafe;
    Word word = testing::RandomWord(random, 5, formula.atoms().size());
    bool before = false;
    for (size_t n = 0; n <= word.size(); ++n) {
      const Word prefix(word.begin(), word.begin() + static_cast<ptrdiff_t>(n));
      const bool now = Evaluate(formula, prefix, Semantics::kCosafe);
      ASSERT_TRUE(now || !before) << formula.ToString();
      before = now;
    }
  }
  EXPECT_GT(cosafe, 500);
}

TEST(Cosafe, WeakNextBesideAnEventualityIsWarnedOf) {
  const auto columns = [](const std::string& text, Semantics semantics = Semantics::kLtlf) {
    std::vector<int> found;
    for (const auto& warning : SemanticsWarnings(ParseFormula(text), semantics))
      found.push_back(warning.where.column);
    return found;
  };
  EXPECT_THAT(columns("F(a & X F b)"), ElementsAre(7));
  EXPECT_THAT(columns("F X a"), ElementsAre(3));
  EXPECT_THAT(columns("G(a -> X F b)"), ElementsAre(8));
  EXPECT_THAT(columns("F(a & X[!] F b)"), IsEmpty());
  EXPECT_THAT(columns("G(a -> X b)"), IsEmpty());
  EXPECT_THAT(columns("F(a & X F b)", Semantics::kCosafe), IsEmpty());
  EXPECT_THAT(SemanticsWarnings(ParseFormula("F X a"), Semantics::kLtlf)[0].ToString(),
              HasSubstr("formula:1:3: X is weak"));
}

TEST(Evaluate, DefinitionsOnShortWords) {
  const auto holds = [](const std::string& text, const std::vector<std::vector<std::string>>& sets,
                        Semantics semantics = Semantics::kLtlf) {
    const Formula formula = ParseFormula(text);
    Word word;
    for (const auto& names : sets) word.push_back(MakeLetter(formula.atoms(), names));
    return Evaluate(formula, word, semantics);
  };
  EXPECT_TRUE(holds("X a", {{}}));
  EXPECT_FALSE(holds("X[!] a", {{}}));
  EXPECT_TRUE(holds("X[!] a", {{}, {"a"}}));
  EXPECT_TRUE(holds("F(a & X F b)", {{"a"}}));
  EXPECT_FALSE(holds("F(a & X F b)", {{"a"}}, Semantics::kCosafe));
  EXPECT_TRUE(holds("F(a & X F b)", {{"a"}, {}, {"b"}}, Semantics::kCosafe));
  EXPECT_FALSE(holds("F(a & X F b)", {{"a", "b"}}, Semantics::kCosafe));
  EXPECT_TRUE(holds("a U b", {{"b"}}));
  EXPECT_TRUE(holds("a U b", {{"a"}, {"b"}, {}}));
  EXPECT_FALSE(holds("a U b", {{"a"}, {}, {"b"}}));
  EXPECT_TRUE(holds("a W b", {{"a"}, {"a"}}));
  EXPECT_TRUE(holds("a R b", {{"b"}, {"a", "b"}, {}}));
  EXPECT_FALSE(holds("a M b", {{"b"}, {"b"}}));
  EXPECT_TRUE(holds("G a & !F a & X a & !a", {}));
  EXPECT_FALSE(holds("a | X[!] true", {}));
  EXPECT_FALSE(holds("!a", {}, Semantics::kCosafe));
  EXPECT_FALSE(holds("!X a", {{}}, Semantics::kCosafe));
  EXPECT_TRUE(holds("!X a", {{}, {}}, Semantics::kCosafe));
}

}  // namespace
}  // namespace tether::ltl
