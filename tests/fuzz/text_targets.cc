#include <cmath>

#include "targets.h"
#include "tether/common/document/value.h"
#include "tether/ltl/automaton/automaton.h"
#include "tether/ltl/automaton/output.h"
#include "tether/ltl/formula/parser.h"
#include "tether/symbolic/grounding/task.h"
#include "tether/symbolic/pddl/pddl.h"

namespace tether::fuzz {
namespace {

// Grounding time grows with the problem; here it must stay short.
constexpr double kMostInstances = 3e4;
constexpr size_t kMostFormulaText = 60;
// Nested X double an automaton each: `tether automaton` has a limit of memory for them.
constexpr ltl::DiagramLimits kSmallDiagrams{2'000, 50'000};

double Instances(const symbolic::Problem& problem) {
  double all = 0;
  for (const auto& action : problem.domain->actions)
    all +=
        std::pow(static_cast<double>(problem.objects.size()), static_cast<double>(action.parameters.size()));
  return all;
}

}  // namespace

void ReadPddlText(const std::string& input) {
  const std::vector<std::string> parts = Split(input, 2);
  const auto domain = symbolic::ParseDomain(parts[0], "domain");
  const std::string written = symbolic::WriteDomain(*domain);
  Require(symbolic::WriteDomain(*symbolic::ParseDomain(written, "written")) == written,
          "a domain is read as it was written");
  const auto problem = symbolic::ParseProblem(parts[1], "problem", domain);
  const std::string text = symbolic::WriteProblem(*problem);
  Require(symbolic::WriteProblem(*symbolic::ParseProblem(text, "written", domain)) == text,
          "a problem is read as it was written");
  if (parts[0].size() + parts[1].size() < 4000 && Instances(*problem) < kMostInstances)
    symbolic::Task::Ground(problem);
}

void ReadFormulaText(const std::string& input) {
  const ltl::Formula formula = ltl::ParseFormula(input);
  const std::string text = formula.ToString();
  Require(ltl::ParseFormula(text).ToString() == text, "a formula is read as it was written");
  if (text.size() > kMostFormulaText) return;
  for (const ltl::Semantics semantics : {ltl::Semantics::kCosafe, ltl::Semantics::kLtlf}) {
    try {
      if (const auto automaton = ltl::BuildAutomaton(formula, semantics, kSmallDiagrams)) {
        ltl::WriteHoa(*automaton, "fuzz", semantics);
        WriteJson(ltl::WriteStates(*automaton));
        ParseYaml(ltl::WriteEdges(*automaton), "edges");
      }
    } catch (const InputError&) {
      // Not co-safe.
    }
  }
}

void ReadYamlText(const std::string& input) {
  const std::string once = WriteJson(ParseYaml(input, "input"));
  // Bytes that are no UTF-8 become the character for that, which is then written as it is.
  Require(WriteJson(ParseYaml(once, "written")) == once || once.find("\\ufffd") != std::string::npos,
          "a document is read as it was written");
}

}  // namespace tether::fuzz
