#include "apps/tether/commands.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>

#include "apps/tether/plan_table.h"
#include "apps/tether/terminal.h"
#include "tether/common/exit_code.h"
#include "tether/common/file.h"
#include "tether/common/limits.h"
#include "tether/common/log.h"
#include "tether/common/output/outputs.h"
#include "tether/common/text.h"
#include "tether/common/version.h"
#include "tether/evaluation/check.h"
#include "tether/evaluation/log/log_files.h"
#include "tether/evaluation/run.h"
#include "tether/execution/sequencer/resolved_plan.h"
#include "tether/planning/check/checker.h"
#include "tether/planning/plan/plan_file.h"
#include "tether/planning/plan/plan_report.h"
#include "tether/scenario/perturb.h"

namespace tether::app {
namespace {

// Margins count as kept down to this, m or rad.
constexpr double kMarginTolerance = 1e-3;

void RequireFolder(const std::string& path, Diagnostics& diagnostics) {
  if (path.empty()) return;
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (!std::filesystem::is_directory(path) || access(path.c_str(), W_OK) != 0) {
    diagnostics.Add({}, "--snapshots: cannot write to folder " + path, "a folder, or where one can be made");
  }
}

double Since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

int ExitCodeOf(planning::PlanStatus status) {
  switch (status) {
    case planning::PlanStatus::kSolved:
      return kExitSuccess;
    case planning::PlanStatus::kImpossible:
      return kExitImpossible;
    case planning::PlanStatus::kGaveUp:
      return kExitGaveUp;
    case planning::PlanStatus::kInterrupted:
      return kExitInterrupted;
    case planning::PlanStatus::kNotCalled:
      break;
  }
  return kExitInternal;
}

int ExitCodeOf(evaluation::RunStatus status) {
  if (status == evaluation::RunStatus::kSuccess) return kExitSuccess;
  return status == evaluation::RunStatus::kInterrupted ? kExitInterrupted : kExitFailed;
}

/// A scenario read for one command, and the time of reading it.
struct Loaded {
  scenario::Scenario scenario;
  std::shared_ptr<const symbolic::Task> task;  ///< Null: `reached` says why.
  Limit reached = Limit::kTime;
  double parse_s = 0;
};

/// With `overrides`, grounding keeps to the limits of planning.
Loaded Load(const std::string& path, const scenario::PlanningOverrides* overrides) {
  const auto begin = std::chrono::steady_clock::now();
  Loaded loaded;
  loaded.scenario = scenario::LoadScenario(path);
  Limits limits;
  std::optional<LimitsScope> scope;
  if (overrides != nullptr) {
    scope.emplace(limits);
    limits.interrupted = overrides->stop;
    limits.memory = overrides->memory_limit;
    limits.SetTimeLimit(overrides->time_limit_s.value_or(loaded.scenario.planning.time_limit_s));
  }
  try {
    loaded.task = scenario::MakeTask(loaded.scenario, limits);
  } catch (const LimitReached& reached) {
    loaded.reached = reached.limit();
  }
  loaded.parse_s = Since(begin);
  return loaded;
}

/// The plan report where grounding did not end.
planning::PlanReport NotGrounded(const Loaded& loaded) {
  planning::PlanReport report;
  const bool interrupted = loaded.reached == Limit::kInterrupted;
  report.status = interrupted ? planning::PlanStatus::kInterrupted : planning::PlanStatus::kGaveUp;
  report.message = "grounding: " + std::string(Describe(loaded.reached));
  return report;
}

planning::PlanReport PlanWithOutput(const Loaded& loaded, planning::Problem& problem,
                                    const Terminal& terminal) {
  terminal.Print(terminal.Bold(loaded.scenario.title) + "  " +
                 terminal.Dim(nlp::ToString(problem.program.backend) +
                              (problem.search.max_actions > 0
                                   ? ", up to " + std::to_string(problem.search.max_actions) + " actions"
                                   : "") +
                              ", seed " + std::to_string(problem.search.seed)));
  if (problem.goal)
    terminal.Print("  " + problem.goal->formula.ToString() +
                   terminal.Dim("  " + ToString(problem.goal->semantics)));
  int number = 0;
  planning::PlanReport report;
  if (loaded.task == nullptr) {
    report = NotGrounded(loaded);
  } else {
    double& limit = problem.search.time_limit_s;
    if (limit > 0) limit = std::max(limit - loaded.parse_s, 1e-9);
    report = planning::PlanTask(problem, *loaded.task, [&](const planning::CandidateReport& candidate) {
      terminal.Print(CandidateLine(candidate, ++number, terminal));
    });
  }
  report.parse_s = loaded.parse_s;
  report.total_s += loaded.parse_s;
  terminal.Print("\n" + PlanTable(report, terminal));
  return report;
}

planning::PlanOrigin Origin(const std::string& scenario, uint64_t seed) {
  return {Version(), seed, std::filesystem::absolute(scenario).lexically_normal().string()};
}

std::vector<scenario::Event> ChooseEvents(const scenario::Scenario& scenario, const std::string& file) {
  if (file.empty()) return scenario.events;
  return scenario::ReadEvents(file, {&scenario.scene, &scenario.actions, scenario.problem.get()});
}

/// A plan is tied to objects and may be run although they have moved; violated constraints are reported
/// before.
void WarnOfViolations(const planning::Plan& plan, const planning::Problem& problem) {
  const planning::CheckResult check = planning::CheckPlan(problem, plan);
  if (!check.Feasible(problem.program)) LogWarning("the plan does not hold in this scene: " + check.Worst());
}

/// Why the executive refuses the best plan, whose key poses may be feasible all the same: it moves what is
/// not held, say. Empty if it does not, or if there is no plan.
std::string WhyNotRunnable(const scenario::Scenario& scenario, const planning::PlanReport& report) {
  const planning::CandidateReport* best = report.best();
  const scenario::Controller controller = scenario.execution.controller;
  if (best == nullptr || controller == scenario::Controller::kConstrainedVelocity) return "";
  if (controller == scenario::Controller::kConstrainedTorque && execution::NeedsObjectives(best->plan))
    return "";
  try {
    execution::Resolve(scenario.scene, best->plan);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

/// Arms and bases that start inside of something.
void WarnOfStarts(const scenario::Scenario& scenario) {
  for (const std::string& problem : evaluation::CheckArms(scenario)) LogWarning(problem);
}

/// The plan to run: read, or the chosen one of those found. Empty, with an exit code, if there is none.
std::optional<planning::Plan> ObtainPlan(const RunArguments& arguments, const Loaded& loaded,
                                         const scene::Scene& scene, const Terminal& terminal, int& exit_code,
                                         Value& plan_report) {
  const scenario::Scenario& scenario = loaded.scenario;
  WarnOfStarts(scenario);
  if (!arguments.plan.empty()) {
    planning::Plan plan = planning::ReadPlan(arguments.plan, scenario.scene, scenario.actions);
    WarnOfViolations(plan, scenario::MakeProblem(scenario, scene, arguments.overrides));
    return plan;
  }
  planning::Problem problem = scenario::MakeProblem(scenario, scene, arguments.overrides);
  const planning::PlanReport report = PlanWithOutput(loaded, problem, terminal);
  plan_report = planning::WritePlanReport(report, scenario.title, problem.search.seed);
  exit_code = ExitCodeOf(report.status);
  std::vector<int> feasible;
  for (int i : report.BestFirst()) {
    if (report.candidates[i].feasible()) feasible.push_back(i);
  }
  if (feasible.empty() || !report.ok()) return std::nullopt;
  const int rank = arguments.candidate.value_or(1);
  if (rank < 1 || rank > static_cast<int>(feasible.size())) {
    throw InputError("--candidate is " + std::to_string(rank) + ", but there are " +
                         std::to_string(feasible.size()) + " feasible candidates",
                     "1 to " + std::to_string(feasible.size()) + ", best first");
  }
  return report.candidates[feasible[rank - 1]].plan;
}

/// Prints the least margin of each constraint.
void PrintMargins(const evaluation::RunReport& report, const Terminal& terminal) {
  if (report.margins.empty()) return;
  terminal.Print(terminal.Bold("least margins over the run"));
  for (const evaluation::Margin& margin : report.margins) {
    if (!std::isfinite(margin.minimum)) continue;
    const bool millimetres = margin.unit == "m";
    const std::string least =
        millimetres ? Fixed(1e3 * margin.minimum, 1) + " mm" : Fixed(margin.minimum, 3) + " " + margin.unit;
    const std::string line = "  " + margin.name + ": " + least;
    const std::string when =
        "  at " + Fixed(margin.time, 2) + " s" + (margin.what.empty() ? "" : ", " + margin.what);
    terminal.Print((margin.minimum < -kMarginTolerance ? terminal.Red(line) : line) + terminal.Dim(when));
  }
}

void PrintJudgement(const evaluation::RunReport& report, const Terminal& terminal) {
  for (const evaluation::GoalFact& fact : report.judgement.facts) {
    const std::string line = "  " + fact.atom +
                             (fact.lapsed  ? " held and no longer does"
                              : fact.holds ? " is true"
                                           : " is false");
    terminal.Print((fact.lapsed ? terminal.Yellow(line) : line) +
                   terminal.Dim(fact.geometric ? "" : "  (by the effects of the actions)"));
  }
  const std::string time = " after " + Fixed(report.sim_time_s, 1) + " s of simulated time (" +
                           Fixed(report.wall_s, 1) + " s on the clock), " + std::to_string(report.retries) +
                           " retries";
  // A failed run is no success even if the goal holds, by an event perhaps: the plan was not carried out.
  const std::string goal = report.ok() ? terminal.Green("goal reached")
                           : report.judgement.goal_reached
                               ? terminal.Yellow("the goal holds, but the plan was not carried out")
                               : terminal.Red("goal not reached");
  if (report.ok()) {
    terminal.Print(goal + time);
  } else {
    terminal.Print(
        goal + time + "; " + ToString(report.status) +
        (report.reason.empty() || report.reason == ToString(report.status) ? "" : ": " + report.reason));
  }
  if (!report.snapshots.empty()) {
    terminal.Print(std::to_string(report.snapshots.size()) + " pictures in " +
                   std::filesystem::path(report.snapshots.front()).parent_path().string());
  }
}

/// Where the log goes, with what was read until now in it.
evaluation::LogSettings LogOf(const RunArguments& arguments) {
  evaluation::LogSettings settings;
  settings.path = arguments.log;
  if (!arguments.log.empty()) settings.files = evaluation::FilesOfThisRun();
  return settings;
}

bool WorthPrinting(const std::string& kind) {
  return kind != "contact" && kind != "safety" && kind != "finished";
}

}  // namespace

int PlanCommand(const PlanArguments& arguments) {
  const Terminal terminal(arguments.json == "-");
  Outputs outputs;
  outputs.Add(arguments.json, "--json");
  outputs.Add(arguments.output, "--output");
  outputs.Add(arguments.trace, "--trace");
  outputs.Require({arguments.scenario});
  scenario::PlanningOverrides overrides = arguments.overrides;
  const Loaded loaded = Load(arguments.scenario, &overrides);
  outputs.RequireUnread();
  overrides.trace = !arguments.trace.empty();
  WarnOfStarts(loaded.scenario);
  planning::Problem problem = scenario::MakeProblem(loaded.scenario, loaded.scenario.scene, overrides);
  const planning::PlanReport report = PlanWithOutput(loaded, problem, terminal);
  ReportingScope reporting;
  const uint64_t seed = problem.search.seed;
  Value value = planning::WritePlanReport(report, loaded.scenario.title, seed);
  if (const std::string why = WhyNotRunnable(loaded.scenario, report); !why.empty()) {
    LogWarning("the best plan can't be run: " + why);
    value.Set("not_runnable", why);
  }
  outputs.Write(arguments.json, value);
  if (!arguments.trace.empty()) outputs.Write(arguments.trace, planning::WriteTrace(report, seed));
  if (!arguments.output.empty()) {
    if (const planning::CandidateReport* best = report.best()) {
      const Value plan = planning::WritePlan(best->plan, Origin(arguments.scenario, seed),
                                             loaded.scenario.scene, loaded.scenario.actions);
      outputs.Write(arguments.output, plan);
      outputs.Finish();
      terminal.Print("the best plan is in " + arguments.output);
    } else {
      LogWarning("no feasible plan: " + arguments.output + " is not written");
    }
  }
  outputs.Finish();
  reporting.Done();
  return ExitCodeOf(report.status);
}

/// In place of the scenario's.
std::optional<task::TemporalGoal> GoalOf(const RunArguments& arguments) {
  const std::string& semantics = arguments.overrides.semantics;
  if (arguments.overrides.goal.empty()) return std::nullopt;
  return scenario::ReadTemporalGoal(arguments.overrides.goal, semantics.empty() ? "cosafe" : semantics);
}

int RunCommand(const RunArguments& arguments) {
  if (!arguments.plan.empty() && arguments.candidate) {
    throw InputError("--plan and --candidate exclude each other", "a plan file holds one plan");
  }
  if (arguments.candidate && *arguments.candidate < 1) {
    throw InputError("--candidate is " + std::to_string(*arguments.candidate), "1 or more: 1 is the best");
  }
  Outputs outputs;
  outputs.Add(arguments.json, "--json");
  outputs.Add(arguments.log, "--log");
  outputs.Require({arguments.scenario, arguments.plan, arguments.events});
  Diagnostics unwritable;
  RequireFolder(arguments.snapshots, unwritable);
  unwritable.ThrowIfAny();
  const Terminal terminal(arguments.json == "-" || arguments.log == "-");
  const Loaded loaded = Load(arguments.scenario, arguments.plan.empty() ? &arguments.overrides : nullptr);
  const scenario::Scenario& scenario = loaded.scenario;
  const uint64_t seed = arguments.overrides.seed.value_or(scenario.seed);
  evaluation::RunOptions options;
  options.seed = seed;
  options.events = ChooseEvents(scenario, arguments.events);
  options.realtime = arguments.realtime;
  options.replan = arguments.mode != "servo";
  options.snapshots = arguments.snapshots;
  options.log = LogOf(arguments);
  options.goal = GoalOf(arguments);
  options.stop = arguments.overrides.stop;
  options.pause = arguments.pause;
  outputs.RequireUnread();
  const scene::Scene scene = scenario::PerturbScene(scenario.scene, scenario.perturb, seed);

  int exit_code = kExitSuccess;
  Value plan_report;
  const auto plan = ObtainPlan(arguments, loaded, scene, terminal, exit_code, plan_report);
  if (!plan) {
    ReportingScope reporting;
    evaluation::RunReport none;
    none.status = exit_code == kExitInterrupted ? evaluation::RunStatus::kInterrupted
                                                : evaluation::RunStatus::kNotCalled;
    const Value* message = plan_report.Find("message");
    none.reason = "there is no plan to run";
    if (message != nullptr && !message->AsText().empty()) none.reason += ": " + message->AsText();
    outputs.Write(arguments.json,
                  evaluation::WriteRunReport(none, scenario.title, seed).Set("planning", plan_report));
    outputs.Finish();
    reporting.Done();
    return exit_code == kExitSuccess ? kExitInternal : exit_code;
  }
  std::string names;
  for (const std::string& action : plan->actions) names += " " + action;
  terminal.Print("\n" + terminal.Bold("running") + names + terminal.Dim("  seed " + std::to_string(seed)));
  options.on_event = [&](double time, const std::string& kind, const std::string& text) {
    if (!WorthPrinting(kind)) return;
    const std::string at = Fixed(time, 2);
    const std::string line =
        std::string(at.size() < 7 ? 7 - at.size() : 0, ' ') + at + " s  " + kind + "  " + text;
    const bool trouble = kind == "disturbance" || kind == "never_happened" || kind == "retry" ||
                         kind.find("miss") != std::string::npos || kind.find("lost") != std::string::npos ||
                         kind == "failed";
    terminal.Print(trouble ? terminal.Yellow(line) : line);
  };
  // The run checks the request to stop at every tick, and reports its progress.
  const Limits none;
  const LimitsScope scope(none);
  const evaluation::RunReport report = evaluation::RunPlan(scenario, scene, *loaded.task, *plan, options);
  ReportingScope reporting;
  PrintJudgement(report, terminal);
  PrintMargins(report, terminal);
  Value json = evaluation::WriteRunReport(report, scenario.title, seed);
  if (!plan_report.is_null()) json.Set("planning", plan_report);
  outputs.Write(arguments.json, json);
  outputs.Finish();
  reporting.Done();
  if (!report.log_problem.empty())
    throw InputError("--log: " + arguments.log + " is not whole: " + report.log_problem);
  return ExitCodeOf(report.status);
}

int CheckCommand(const CheckArguments& arguments) {
  const Terminal terminal;
  bool rejected = false, wrong = false;
  Diagnostics mistakes;
  for (const evaluation::FileCheck& check : evaluation::CheckFiles(arguments.files, mistakes)) {
    const bool fine = check.problems.empty();
    // A scenario that disagrees with itself is bad input; a plan that doesn't hold is judged and failed.
    (check.kind == "plan" || check.kind == "log" ? rejected : wrong) |= !fine;
    std::string line = check.file + ": " + check.kind + ", ";
    line += fine ? terminal.Green("ok")
                 : terminal.Red(std::to_string(check.problems.size()) +
                                (check.problems.size() == 1 ? " problem" : " problems"));
    for (const std::string& note : check.notes) line += "; " + note;
    terminal.Print(line);
    for (const std::string& problem : check.problems) terminal.Print("  " + problem);
  }
  mistakes.ThrowIfAny();
  return wrong ? kExitBadInput : rejected ? kExitFailed : kExitSuccess;
}

int CampaignCommand(const CampaignArguments& arguments) {
  const bench::CampaignOptions& options = arguments.options;
  options.Validate();
  Outputs outputs;
  outputs.Add(options.output, "--output");
  outputs.Add(arguments.json, "--json");
  outputs.Require({options.scenario});
  const Terminal terminal(arguments.json == "-");
  const bench::CampaignResult result =
      bench::RunCampaign(options, [&](int number, int count, const Value& record) {
        const std::string line = bench::CampaignLine(number, count, record);
        if (!line.empty()) terminal.Print(line);
      });
  ReportingScope reporting;
  const Value summary = bench::SummarizeCampaign(options, result);
  terminal.Print(bench::CampaignTable(summary));
  outputs.Write(arguments.json, summary);
  outputs.Finish();
  reporting.Done();
  if (!result.interrupted) return kExitSuccess;
  terminal.Print(terminal.Yellow(
      "interrupted" + (options.output.empty() ? "" : "; the same command goes on from " + options.output)));
  return kExitInterrupted;
}

}  // namespace tether::app
