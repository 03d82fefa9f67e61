#include "apps/tether/automaton_command.h"

#include <chrono>
#include <cstdio>

#include "apps/tether/commands.h"
#include "apps/tether/terminal.h"
#include "tether/common/exit_code.h"
#include "tether/common/log.h"
#include "tether/common/output/output_header.h"
#include "tether/common/output/outputs.h"
#include "tether/common/text.h"
#include "tether/ltl/automaton/output.h"
#include "tether/ltl/formula/cosafe.h"
#include "tether/ltl/formula/parser.h"
#include "tether/ltl/formula/words.h"

namespace tether::app {
namespace {

/// Larger automata are not printed.
constexpr int kMostStatesListed = 100;
constexpr size_t kMostLines = 400;

std::string Count(int number, const std::string& what) {
  return std::to_string(number) + " " + what + (number == 1 ? "" : "s");
}

void PrintAutomaton(const CompiledFormula& compiled, bool summary, const Terminal& terminal) {
  const ltl::Automaton& automaton = *compiled.automaton;
  terminal.Print(terminal.Bold(compiled.formula.ToString()) + "  " +
                 terminal.Dim(ToString(compiled.semantics)));
  terminal.Print(Count(automaton.states(), "state") + ", " +
                 Count(static_cast<int>(automaton.atoms().size()), "proposition") + "; " +
                 Fixed(1e3 * compiled.compile_s, 2) + " ms");
  if (summary) return;
  if (automaton.states() > kMostStatesListed) {
    terminal.Print(terminal.Dim("too many states to list: --hoa, --dot and --json write all of them"));
  } else {
    std::string table = AutomatonTable(automaton, kMostLines);
    table.pop_back();  // The last newline is Print's.
    terminal.Print("\n" + table);
  }
}

}  // namespace

CompiledFormula CompileFormula(const std::string& text, const std::string& semantics) {
  CompiledFormula compiled;
  compiled.semantics = ltl::ReadSemantics(semantics);
  const auto begin = std::chrono::steady_clock::now();
  const ltl::Formula read = ltl::ParseFormula(text);
  compiled.formula = ltl::ReadEnds(read, compiled.semantics);
  compiled.automaton = BuildAutomaton(compiled.formula, compiled.semantics);
  compiled.compile_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  for (const auto& warnings :
       {SemanticsWarnings(compiled.formula, compiled.semantics), WordWarnings(read, compiled.semantics)}) {
    for (const Diagnostic& warning : warnings) LogWarning(warning.ToString());
  }
  return compiled;
}

namespace {

Value ReportHeader(const CompiledFormula& compiled) {
  Value report = OutputHeader("tether.automaton/1", 0);
  report.Set("formula", compiled.formula.ToString()).Set("semantics", ToString(compiled.semantics));
  report.Set("satisfiable", compiled.automaton->IsSatisfiable()).Set("compile_s", compiled.compile_s);
  return report;
}

}  // namespace

std::string WriteAutomatonReport(const CompiledFormula& compiled) {
  Value report = ReportHeader(compiled);
  const Value automaton = ltl::WriteStates(*compiled.automaton);
  for (const Value::Member& member : automaton.members()) report.Set(member.key, member.value);
  std::string text = WriteJson(report);
  // The edges are written as text at once: as values they need a hundred times the memory.
  text.resize(text.rfind('\n', text.rfind('}')));
  return text + ",\n  \"edges\": " + ltl::WriteEdges(*compiled.automaton) + "\n}\n";
}

Value WriteAutomatonSummary(const CompiledFormula& compiled) {
  const ltl::Automaton& automaton = *compiled.automaton;
  int accepting = 0, lost = 0;
  for (int state = 0; state < automaton.states(); ++state) {
    accepting += automaton.IsAccepting(state);
    lost += automaton.IsTrap(state);
  }
  Value atoms = Value::Array();
  for (const std::string& atom : automaton.atoms()) atoms.Append(atom);
  return ReportHeader(compiled)
      .Set("atoms", std::move(atoms))
      .Set("states", automaton.states())
      .Set("initial", automaton.initial())
      .Set("accepting_states", accepting)
      .Set("lost_states", lost);
}

int AutomatonCommand(const AutomatonArguments& arguments) {
  const bool json_to_stdout = arguments.json == "-";
  if (json_to_stdout && (arguments.hoa || arguments.dot)) {
    throw InputError("--json - and --hoa or --dot would both write to standard output",
                     "one of them, or --json with a file");
  }
  if (arguments.summary && (arguments.hoa || arguments.dot)) {
    throw InputError("--summary leaves out the edges that --hoa and --dot are made of", "one of them");
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
  if (!arguments.json.empty()) {
    outputs.WriteText(arguments.json, arguments.summary ? WriteJson(WriteAutomatonSummary(compiled))
                                                        : WriteAutomatonReport(compiled));
  }
  if (arguments.hoa) {
    outputs.WriteText("-", WriteHoa(*compiled.automaton, compiled.formula.ToString(), compiled.semantics));
  } else if (arguments.dot) {
    outputs.WriteText("-", WriteDot(*compiled.automaton, compiled.formula.ToString()));
  } else if (!json_to_stdout) {
    PrintAutomaton(compiled, arguments.summary, terminal);
  }
  outputs.Finish();
  if (compiled.automaton->IsSatisfiable()) return kExitSuccess;
  std::fprintf(stderr, "the formula cannot be satisfied: no finite word, however long, makes it true\n");
  return kExitImpossible;
}

}  // namespace tether::app
