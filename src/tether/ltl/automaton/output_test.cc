#include "tether/ltl/automaton/output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/ltl/formula/parser.h"

namespace tether::ltl {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Automaton Build(const std::string& text, Semantics semantics) {
  return *BuildAutomaton(ParseFormula(text), semantics);
}

TEST(Output, HoaIsAsTheFormatSays) {
  EXPECT_EQ(WriteHoa(Build("F(a & X on(b,c))", Semantics::kCosafe), "F(a & X on(b,c))", Semantics::kCosafe),
            R"text(HOA: v1
name: "F(a & X on(b,c))"
tool: "tether"
States: 3
Start: 0
AP: 2 "a" "on(b,c)"
acc-name: Buchi
Acceptance: 1 Inf(0)
properties: trans-labels explicit-labels state-acc complete deterministic weak terminal
--BODY--
State: 0
[!0] 0
[0] 1
State: 1
[!0&!1] 0
[0&!1] 1
[1] 2
State: 2 {0}
[t] 2
--END--
)text");
  EXPECT_THAT(WriteHoa(Build("G !a", Semantics::kLtlf), "G !a", Semantics::kLtlf),
              Not(HasSubstr("terminal")));
  EXPECT_THAT(WriteHoa(Build("true", Semantics::kLtlf), "true", Semantics::kLtlf), HasSubstr("AP: 0\n"));
}

TEST(Output, DotQuotesWhatNeedsIt) {
  const std::string dot = WriteDot(Build("G !\"a \\\"b\\\"\"", Semantics::kLtlf), "G !\"a \\\"b\\\"\"");
  EXPECT_EQ(dot, R"text(digraph automaton {
  label="G !\"a \\\"b\\\"\"";
  labelloc=t;
  rankdir=LR;
  node [shape=circle];
  start [shape=point];
  start -> 0;
  0 [shape=doublecircle];
  1 [style=dashed];
  0 -> 0 [label="!\"a \\\"b\\\"\""];
  0 -> 1 [label="\"a \\\"b\\\"\""];
  1 -> 1 [label="true"];
}
)text");
}

TEST(Output, JsonHasTheStatesAndTheEdges) {
  const Automaton automaton = Build("F(a | \"b \\\" c\")", Semantics::kCosafe);
  const Value states = WriteStates(automaton);
  EXPECT_EQ(states.Find("states")->integer(), 2);
  EXPECT_EQ(states.Find("accepting")->items().at(0).integer(), 1);
  const Value edges = ParseYaml(WriteEdges(automaton), "edges");
  ASSERT_EQ(edges.items().size(), 3u);
  EXPECT_EQ(edges.items().at(0).Find("guard")->AsText(), "!a & !\"b \\\" c\"");
  ASSERT_EQ(edges.items().at(1).Find("cubes")->items().size(), 2u);
  EXPECT_EQ(edges.items().at(1).Find("to")->integer(), 1);
  EXPECT_EQ(edges.items().at(1).Find("cubes")->items().at(1).items().at(0).AsText(), "\"b \\\" c\"");
  EXPECT_EQ(edges.items().at(2).Find("cubes")->items().at(0).items().size(), 0u);
}

TEST(Output, TablesEndWhereTheyMust) {
  const Automaton automaton = Build("a", Semantics::kLtlf);
  EXPECT_EQ(AutomatonTable(automaton, 10),
            "state     to  when\n    0      1  !a\n           2  a\n    1      1  true   (lost)\n"
            "    2      2  true   (accepting)\n");
  EXPECT_THAT(AutomatonTable(automaton, 1), HasSubstr("… and 3 more transitions"));
}

}  // namespace
}  // namespace tether::ltl
