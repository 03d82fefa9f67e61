#include "tether/experiment/automaton.h"

#include <chrono>
#include <cstdio>

#include "tether/common/log.h"
#include "tether/experiment/commands.h"
#include "tether/experiment/outputs.h"
#include "tether/experiment/plan_output.h"
#include "tether/experiment/terminal.h"
#include "tether/ltl/cosafe.h"
#include "tether/ltl/output.h"
#include "tether/ltl/parser.h"

namespace tether::experiment {
namespace {

/// Larger automata are not for reading.
constexpr int kMostStatesListed = 100;
constexpr size_t kMostLines = 400;

std::string Count(int number, const std::string& what) {
  return std::to_string(number) + " " + what + (number == 1 ? "" : "s");
}

void PrintAutomaton(const CompiledFormula& compiled, const Terminal& terminal) {
  const ltl::Automaton& automaton = *compiled.automaton;
  terminal.Print(terminal.Bold(compiled.formula.ToString()) + "  " +
                 terminal.Dim(ToString(compiled.semantics)));
  terminal.Print(Count(automaton.states(), "state") + ", " +
                 Count(static_cast<int>(automaton.atoms().size()), "proposition") + "; " +
                 Fixed(1e3 * compiled.compile_s, 2) + " ms");
  if (automaton.states() > kMostStatesListed) {
    terminal.Print(terminal.Dim("too many states to list: --hoa, --dot and --json write all of them"));
  } else {
    std::string table = AutomatonTable(automaton, kMostLines);
    table.pop_back();  // The last newline is Print's.
    terminal.Print("\n" + table);
  }
}

}  // namespace

ltl::Semantics ReadSemantics(const std::string& name) {
  for (ltl::Semantics semantics : {ltl::Semantics::kCosafe, ltl::Semantics::kLtlf}) {
    if (name == ToString(semantics)) return semantics;
  }
  throw InputError("--semantics: unknown '" + name + "'", SuggestFrom(name, {"cosafe", "ltlf"}));
}

CompiledFormula CompileFormula(const std::string& text, const std::string& semantics) {
  CompiledFormula compiled;
  compiled.semantics = ReadSemantics(semantics);
  const auto begin = std::chrono::steady_clock::now();
  compiled.formula = ltl::ParseFormula(text);
  compiled.automaton = BuildAutomaton(compiled.formula, compiled.semantics);
  compiled.compile_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  for (const Diagnostic& warning : SemanticsWarnings(compiled.formula, compiled.semantics)) {
    LogWarning(warning.ToString());
  }
  return compiled;
}

Value WriteAutomatonReport(const CompiledFormula& compiled) {
  Value report = OutputHeader("tether.automaton/1", 0);
  report.Set("formula", compiled.formula.ToString()).Set("semantics", ToString(compiled.semantics));
  report.Set("satisfiable", compiled.automaton->IsSatisfiable()).Set("compile_s", compiled.compile_s);
  const Value automaton = WriteAutomaton(*compiled.automaton);
  for (const Value::Member& member : automaton.members()) report.Set(member.key, member.value);
  return report;
}

int AutomatonCommand(const AutomatonArguments& arguments) {
  const bool json_to_stdout = arguments.json == "-";
  if (json_to_stdout && (arguments.hoa || arguments.dot)) {
    throw InputError("--json - and --hoa or --dot would both write to standard output",
                     "one of them, or --json with a file");
  }
  Outputs outputs;
  outputs.Add(arguments.json, "--json");
  outputs.Require();
  const CompiledFormula compiled = CompileFormula(arguments.formula, arguments.semantics);
  const Terminal terminal(json_to_stdout);
  if (!compiled.automaton) {
    std::fprintf(stderr,
                 "gave up: the automaton has too many states or transitions to be built as a whole\n");
    return kExitGaveUp;
  }
  if (!arguments.json.empty()) outputs.Write(arguments.json, WriteAutomatonReport(compiled));
  if (arguments.hoa) {
    outputs.WriteText("-", WriteHoa(*compiled.automaton, compiled.formula.ToString(), compiled.semantics));
  } else if (arguments.dot) {
    outputs.WriteText("-", WriteDot(*compiled.automaton, compiled.formula.ToString()));
  } else if (!json_to_stdout) {
    PrintAutomaton(compiled, terminal);
  }
  outputs.Finish();
  if (compiled.automaton->IsSatisfiable()) return kExitSuccess;
  std::fprintf(stderr, "the formula cannot be satisfied: no finite word, however long, makes it true\n");
  return kExitImpossible;
}

}  // namespace tether::experiment
