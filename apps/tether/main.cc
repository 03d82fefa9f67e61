// The program: parses the command line, and leaves the work to apps/tether/commands.h.

#include <charconv>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <functional>
#include <iostream>
#include <new>

#include <CLI/CLI.hpp>

#include "apps/tether/signals.h"

#include "apps/tether/commands.h"
#include "apps/tether/task_command.h"
#include "apps/tether/terminal.h"
#include "tether/common/error.h"
#include "tether/common/exit_code.h"
#include "tether/common/limits.h"
#include "tether/common/log.h"
#include "tether/common/version.h"

namespace {

using namespace tether;
using namespace tether::app;

/// CLI11 alone would read -4, and numbers that are too large, as the nearest valid number.
CLI::Validator WholeNumber() {
  return CLI::Validator(
      [](std::string& text) -> std::string {
        uint64_t number = 0;
        const char* const end = text.data() + text.size();
        const auto [read, error] = std::from_chars(text.data(), end, number);
        const bool whole = error == std::errc() && read == end;
        return whole ? "" : "'" + text + "' (a whole number from 0 to 18446744073709551615 is accepted)";
      },
      "");
}

/// An empty value is most likely a shell variable that is not set.
void RefuseEmptyValues(CLI::App& command) {
  for (CLI::Option* option : command.get_options()) {
    if (!option->nonpositional() || option->get_expected_max() == 0) continue;
    const std::string what =
        option->get_type_name() == "FORMULA" ? "the formula is empty" : "the value is empty";
    option->check(
        CLI::Validator([what](std::string& text) -> std::string { return text.empty() ? what : ""; }, ""));
  }
  for (CLI::App* one : command.get_subcommands({})) RefuseEmptyValues(*one);
}

void AddMemoryLimit(CLI::App& command, size_t& bytes) {
  command
      .add_option_function<std::string>(
          "--memory-limit", [&bytes](const std::string& text) { bytes = *tether::ParseMemorySize(text); },
          "The program gives up when it occupies so much memory, such as 500M or 4G (without a unit: MiB; "
          "default 2G); 0: no limit")
      ->check(CLI::Validator(
          [](std::string& text) -> std::string {
            return tether::ParseMemorySize(text)
                       ? ""
                       : "'" + text + "' (a size is accepted, such as 512, 500M or 2.5G; 0: no limit)";
          },
          ""))
      ->type_name("SIZE");
}

void AddPlanningOptions(CLI::App& command, scenario::PlanningOverrides& overrides) {
  command.add_option("--solver", overrides.solver, "Nonlinear solver: native, ipopt or nlopt")
      ->type_name("NAME");
  command.add_option("--max-actions", overrides.max_actions, "Longest action sequence tried")->type_name("N");
  command.add_option("--threads", overrides.threads, "Candidates optimised at once; 0: all processors")
      ->type_name("N");
  command
      .add_option("--time-limit", overrides.time_limit_s,
                  "Grounding and planning stop after so many seconds; 0: no limit")
      ->type_name("S");
  AddMemoryLimit(command, overrides.memory_limit);
  command.add_option("--goal", overrides.goal, "Temporal formula, in place of the scenario's goal")
      ->type_name("FORMULA");
  command.add_option("--semantics", overrides.semantics, "Of the temporal goal: cosafe (default) or ltlf")
      ->type_name("NAME");
  command
      .add_option(
          "--search", overrides.search,
          "astar (default), dijkstra or bfs: action sequences cheapest first; greedy: some sequence, fast")
      ->type_name("NAME");
  command
      .add_option("--max-iterations", overrides.max_iterations,
                  "Iterations of one solve of a candidate's key poses, in the solver's own unit (default: "
                  "what it needs)")
      ->type_name("N");
}

void AddPlan(CLI::App& app, PlanArguments& arguments, std::function<int()>& run) {
  CLI::App* command = app.add_subcommand("plan", "Find and optimise plans for a scenario, best first");
  command->add_option("scenario", arguments.scenario, "Scenario file")->required()->type_name("SCENARIO");
  AddPlanningOptions(*command, arguments.overrides);
  command
      ->add_option("--max-plans", arguments.overrides.max_plans,
                   "Only the best so many: what can't be among them is pruned; 0: all there are")
      ->type_name("K");
  command->add_flag("--no-robot", arguments.overrides.no_robot,
                    "Plan for a free-flying hand, without the arm's reach");
  command->add_flag("--no-motion", arguments.overrides.no_motion,
                    "Key poses alone, without the arm's motions between them");
  command->add_option("--seed", arguments.overrides.seed, "Seed, in place of the scenario's")
      ->check(WholeNumber())
      ->type_name("N");
  command->add_option("--json", arguments.json, "Write the report as JSON to FILE, or - for standard output")
      ->type_name("FILE");
  command->add_option("--output", arguments.output, "Write the best plan to PLAN")->type_name("PLAN");
  command->add_option("--trace", arguments.trace, "Write cost and violation per iteration to FILE")
      ->type_name("FILE");
  command->footer(R"(Examples:
  tether plan scenarios/workspace_reach.yaml
  tether plan scenarios/hanoi.yaml --max-actions 14 --solver nlopt
  tether plan scenarios/stacking.yaml --goal 'F(on(coral,blue) & X F on(denim,amber))'
  tether plan scenarios/workspace_reach.yaml --json - | jq '.plans[0].actions'
  tether plan scenarios/workspace_reach.yaml --output plan.json --trace trace.json)");
  command->callback([&] {
    run = [&] {
      arguments.overrides.stop = &StopRequested();
      return PlanCommand(arguments);
    };
  });
}

void AddRun(CLI::App& app, RunArguments& arguments, std::function<int()>& run) {
  CLI::App* command = app.add_subcommand("run", "Execute a plan in simulation and judge the goal");
  command->add_option("scenario", arguments.scenario, "Scenario file")->required()->type_name("SCENARIO");
  command->add_option("--plan", arguments.plan, "Plan file; without it, the scenario is planned first")
      ->type_name("PLAN");
  command->add_option("--candidate", arguments.candidate, "Run the N-th best candidate instead of the best")
      ->type_name("N");
  command->add_option("--events", arguments.events, "Disturbances from FILE, in place of the scenario's")
      ->type_name("FILE");
  command
      ->add_option("--seed", arguments.overrides.seed, "Seed, in place of the scenario's: perturbs the start")
      ->check(WholeNumber())
      ->type_name("N");
  command->add_flag("--realtime", arguments.realtime, "Not faster than the clock on the wall");
  command
      ->add_option(
          "--mode", arguments.mode,
          "reactive: the plan is made anew where the observed state no longer allows it; servo: never")
      ->check(CLI::IsMember({"reactive", "servo"}))
      ->capture_default_str();
  command->add_option("--snapshots", arguments.snapshots, "Write a PNG at each step boundary to DIR")
      ->type_name("DIR");
  command->add_option("--json", arguments.json, "Write the report as JSON to FILE, or - for standard output")
      ->type_name("FILE");
  command
      ->add_option(
          "--log", arguments.log,
          "Write what happens to FILE while it does (MCAP), for `tether check`, `report` and Foxglove")
      ->type_name("FILE");
  AddPlanningOptions(*command, arguments.overrides);
  command->footer(R"(Examples:
  tether run scenarios/workspace_reach.yaml
  tether run scenarios/workspace_reach.yaml --events scenarios/workspace_reach/events_box_moved.yaml --seed 3
  tether run scenarios/hanoi.yaml --candidate 2 --snapshots snapshots
  tether run scenarios/workspace_reach.yaml --plan plan.json --json run.json)");
  command->callback([&] {
    run = [&] {
      arguments.pause = &PauseRequested();
      arguments.overrides.stop = &StopRequested();
      return RunCommand(arguments);
    };
  });
}

void AddReport(CLI::App& app, ReportArguments& arguments, std::function<int()>& run) {
  CLI::App* command =
      app.add_subcommand("report", "Report a run's log or a campaign: summary, plots and tables");
  command->add_option("log", arguments.log, "What `tether run --log` or `tether campaign` wrote")
      ->required()
      ->type_name("LOG");
  command
      ->add_option("--output", arguments.output,
                   "File to write: a page if it ends with .html, else a figure (SVG); -: the figure on "
                   "standard output")
      ->required()
      ->type_name("FILE");
  command->footer(R"(Examples:
  tether run scenarios/assistive.yaml --log run.mcap && tether report run.mcap --output run.html
  tether report run.mcap --output figure.svg
  tether campaign control --output control.jsonl && tether report control.jsonl --output control.html)");
  command->callback([&] { run = [&] { return ReportCommand(arguments); }; });
}

void AddCheck(CLI::App& app, CheckArguments& arguments, std::function<int()>& run) {
  CLI::App* command = app.add_subcommand(
      "check", "Validate scenarios, action libraries, event files and plans; judge logged runs again");
  command->add_option("files", arguments.files, "Files, recognised by their `format`")
      ->required()
      ->type_name("FILE");
  command->footer(R"(Examples:
  tether check scenarios/workspace_reach.yaml
  tether check models/actions/manipulation.yaml scenarios/*.yaml
  tether check scenarios/workspace_reach.yaml plan.json
  tether check run.mcap)");
  command->callback([&] { run = [&] { return CheckCommand(arguments); }; });
}

void AddBench(CLI::App& app, BenchArguments& arguments, std::function<int()>& run) {
  CLI::App* command = app.add_subcommand("bench", "Run a benchmark");
  std::string names = "Benchmarks:\n";
  for (const auto& [name, text] : BenchNames()) names += "  " + name + ": " + text + "\n";
  command->add_option("name", arguments.name, "Which one")->required()->type_name("NAME");
  command->add_option("--json", arguments.json, "Write the result as JSON to FILE, or - for standard output")
      ->type_name("FILE");
  command
      ->add_option("--scenario", arguments.scenarios, "planning: a scenario file, instead of those that ship")
      ->type_name("FILE")
      ->allow_extra_args(false);
  command->add_option("--solver", arguments.solvers, "planning: only this solver; may be given several times")
      ->type_name("NAME")
      ->allow_extra_args(false);
  command
      ->add_option("--repetitions", arguments.repetitions,
                   "planning: how often the native solver is asked (50), IPOPT a tenth and NLopt a fiftieth")
      ->type_name("N");
  command->add_flag("--no-robot", arguments.no_robot, "planning: without the arm's reach");
  command->add_option("--ticks", arguments.ticks, "control: ticks per robot and form of region (20,000)")
      ->type_name("N");
  command
      ->add_option(
          "--paced", arguments.paced,
          "control: only ticks at 1 kHz by the clock for so many seconds, while another process loads "
          "the other cores; more than 0.1 % of them late is a failure")
      ->type_name("S");
  command
      ->add_option(
          "--problems", arguments.problems,
          "motion: a folder with sceneN.yaml and requestN.yaml of MotionBenchMaker, or folders of such")
      ->type_name("DIR");
  command->add_option("--robot", arguments.robot, "motion: a robot's name or file (panda_flange)")
      ->type_name("NAME");
  command->footer(names + R"(
Examples:
  tether bench planning
  tether bench planning --solver native --repetitions 200 --scenario scenarios/hanoi.yaml --json -
  tether bench table1
  tether bench geometry --json geometry.json
  tether bench motion --problems problems --json motion.json)");
  command->callback([&] {
    run = [&] {
      arguments.stop = &StopRequested();
      std::error_code unknown;  // Then the process is not timed.
      arguments.program = std::filesystem::read_symlink("/proc/self/exe", unknown).string();
      return BenchCommand(arguments);
    };
  });
}

void AddGenerate(CLI::App& app, GenerateArguments& arguments, std::function<int()>& run) {
  CLI::App* command =
      app.add_subcommand("generate", "Write a random scenario: scenario.yaml and its PDDL files");
  command->require_subcommand(1);
  for (const auto& [kind, text] : scenario::GeneratorKinds()) {
    CLI::App* one = command->add_subcommand(kind, text);
    scenario::GeneratorParameters& parameters = arguments.parameters;
    if (kind == "hanoi" || kind == "stack") {
      one->add_option("--blocks", parameters.blocks, "Number of blocks, 2 to 8 (default 3)")->type_name("N");
    }
    if (kind == "sort" || kind == "bin" || kind == "clutter" || kind == "crowd") {
      const std::string what = kind == "clutter" ? "Number of obstacles, 0 to 12 (default 6)"
                               : kind == "crowd" ? "Number of things that stand around, 0 to 200 (default 6)"
                                                 : "Number of things, 1 to 8 (default 6)";
      one->add_option("--objects", parameters.objects, what)->type_name("N");
    }
    if (kind == "sort") {
      one->add_option("--regions", parameters.regions, "Number of trays, 1 to 4 (default 2)")->type_name("M");
    }
    one->add_option("--seed", arguments.seed, "The same seed gives the same files (default 1)")
        ->check(WholeNumber())
        ->type_name("S");
    one->add_option("--output", arguments.output, "Folder for the files; made if it is not there")
        ->required()
        ->type_name("DIR");
    one->add_flag("--force", arguments.force, "Replace files that are there already");
    one->callback([&, kind = kind] {
      arguments.kind = kind;
      run = [&] { return GenerateCommand(arguments); };
    });
  }
  command->footer(R"(Examples:
  tether generate hanoi --blocks 5 --output hanoi_5
  tether generate reach --seed 17 --output reach_17
  tether generate sort --objects 6 --regions 3 --seed 2 --output sort
  tether plan reach_17/scenario.yaml)");
}

void AddCampaign(CLI::App& app, CampaignArguments& arguments, std::function<int()>& run) {
  CLI::App* command = app.add_subcommand("campaign", "Plan many random scenes and say how planning did");
  bench::CampaignOptions& options = arguments.options;
  std::string names = "Campaigns:\n";
  for (const auto& [name, text] : bench::CampaignNames()) names += "  " + name + ": " + text + "\n";
  command->add_option("name", options.name, "Which one")->required()->type_name("NAME");
  command->add_option("--scenes", options.scenes, "Scenes per kind, or per number of blocks")->type_name("N");
  command->add_flag("--no-robot", options.no_robot, "execution: plan without the arm, to compare");
  command
      ->add_option(
          "--kind", options.kinds,
          "Only scenes of this kind: reach, stack or, for execution, clutter, around, posts or shelf; for "
          "control: seeds, moved or crossing; may be given again")
      ->type_name("KIND")
      ->allow_extra_args(false);
  command->add_option("--scenario", options.scenario, "control: instead of the assistive scenario that ships")
      ->type_name("FILE");
  command
      ->add_option("--command", options.command,
                   "control: velocity or torque, in place of what the scenario's controller commands")
      ->type_name("KIND");
  command->add_option("--restarts", options.restarts, "Random starts of a scene (default 100)")
      ->type_name("N");
  command
      ->add_option("--seed", options.seed, "Of the first scene (default 1); the next has one more, and so on")
      ->check(WholeNumber())
      ->type_name("S");
  command
      ->add_option("--output", options.output,
                   "A line of JSON per finished scene; scenes that are there already are not measured again")
      ->type_name("FILE");
  command->add_option("--json", arguments.json, "Write the summary as JSON to FILE, or - for standard output")
      ->type_name("FILE");
  command->footer(names + R"(
Examples:
  tether campaign robustness --scenes 100 --kind reach
  tether campaign robustness --output robustness.jsonl
  tether campaign quality --output quality.jsonl --json quality.json
  tether campaign growth
  tether campaign control --kind moved --output moved.jsonl)");
  command->callback([&] {
    run = [&] {
      arguments.options.stop = &StopRequested();
      return CampaignCommand(arguments);
    };
  });
}

void AddAutomaton(CLI::App& app, AutomatonArguments& arguments, std::function<int()>& run) {
  CLI::App* command = app.add_subcommand("automaton", "Compile a temporal formula to its minimal automaton");
  command->add_option("formula", arguments.formula, "Temporal formula")->required()->type_name("FORMULA");
  command
      ->add_option("--semantics", arguments.semantics,
                   "cosafe (default): X is strong, once accepted is always accepted; ltlf: the word is all "
                   "there is, X is weak and X[!] strong")
      ->type_name("NAME");
  CLI::Option* hoa = command->add_flag("--hoa", arguments.hoa, "Write the Hanoi omega-automata format");
  command->add_flag("--dot", arguments.dot, "Write a graph for graphviz")->excludes(hoa);
  command
      ->add_option("--json", arguments.json, "Write the automaton as JSON to FILE, or - for standard output")
      ->type_name("FILE");
  command->add_flag("--summary", arguments.summary,
                    "Only the numbers of states: with --json, a report without states and edges");
  command->footer(
      R"(Operators, tightest first: ! F G X X[!]; U R W M; &; xor; |; -> <->. Propositions are names,
ground predicates such as on(box,shelf), or any text in double quotes.

Examples:
  tether automaton 'F(in(meat,heat) & X F in(meat,person))'
  tether automaton 'G !in(knife,person) & F on(a,b)' --semantics ltlf --dot | dot -Tsvg > automaton.svg
  tether automaton 'a U (b & X c)' --hoa
  tether automaton 'F a & F b' --summary --json - | jq .states)");
  command->callback([&] { run = [&] { return AutomatonCommand(arguments); }; });
}

void AddTask(CLI::App& app, TaskArguments& arguments, std::function<int()>& run) {
  CLI::App* command = app.add_subcommand("task", "Search a PDDL problem for plans, without a scene");
  command->add_option("domain", arguments.domain, "PDDL domain")->required()->type_name("DOMAIN");
  command->add_option("problem", arguments.problem, "PDDL problem")->required()->type_name("PROBLEM");
  command->add_option("--goal", arguments.goal, "Temporal formula, in place of the problem's goal")
      ->type_name("FORMULA");
  command->add_option("--semantics", arguments.semantics, "Of the formula: cosafe (default) or ltlf")
      ->type_name("NAME");
  command
      ->add_option(
          "--search", arguments.search,
          "astar (default): cheapest plans, by landmark cuts; greedy: some plan, fast; dijkstra and bfs: "
          "cheapest and shortest plans without a heuristic, and the whole of the state space")
      ->type_name("NAME");
  command->add_option("--max-plans", arguments.max_plans, "So many plans, cheapest first (default 1); 0: all")
      ->type_name("K");
  command
      ->add_option("--time-limit", arguments.time_limit_s,
                   "Reading, grounding and search stop after so many seconds; 0: no limit")
      ->type_name("S");
  AddMemoryLimit(*command, arguments.memory_limit);
  command->add_option("--json", arguments.json, "Write the report as JSON to FILE, or - for standard output")
      ->type_name("FILE");
  command->footer(R"(Examples:
  tether task scenarios/hanoi/domain.pddl scenarios/hanoi/problem.pddl
  tether task domain.pddl problem.pddl --search greedy --time-limit 10
  tether task domain.pddl problem.pddl --goal 'F(on(a,b) & X F on(b,c))' --max-plans 3 --json -)");
  command->callback([&] {
    run = [&] {
      arguments.stop = &StopRequested();
      return TaskCommand(arguments);
    };
  });
}

int Main(int argc, char** argv) {
  CLI::App app("Robot manipulation planned as poses tied to objects, executed by reactive control.",
               "tether");
  app.set_version_flag("--version", "tether " + Version());
  bool verbose = false;
  app.add_flag("--verbose", verbose, "Say more, on standard error");
  size_t memory_limit = tether::kDefaultMemoryLimit;
  app.require_subcommand(1);
  app.fallthrough();
  app.footer(R"(Examples:
  tether plan scenarios/workspace_reach.yaml
  tether run scenarios/workspace_reach.yaml --events scenarios/workspace_reach/events_box_moved.yaml
  tether check scenarios/hanoi.yaml
Each command has its own --help.
Exit codes: 0 success, 1 internal error, 2 bad input, 3 proved impossible, 4 gave up at a limit, 5 judged and failed,
130 interrupted.)");
  PlanArguments plan;
  RunArguments run;
  ReportArguments report;
  CheckArguments check;
  BenchArguments bench;
  GenerateArguments generate;
  CampaignArguments campaign;
  AutomatonArguments automaton;
  TaskArguments task;
  std::function<int()> command;
  AddPlan(app, plan, command);
  AddRun(app, run, command);
  AddReport(app, report, command);
  AddCheck(app, check, command);
  AddBench(app, bench, command);
  AddGenerate(app, generate, command);
  AddCampaign(app, campaign, command);
  AddAutomaton(app, automaton, command);
  AddTask(app, task, command);
  for (CLI::App* one : app.get_subcommands({}))
    if (one->get_option_no_throw("--memory-limit") == nullptr) AddMemoryLimit(*one, memory_limit);
  RefuseEmptyValues(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    if (!std::cout.flush()) throw tether::InputError("cannot write to standard output");
    return code == 0 ? kExitSuccess : kExitBadInput;
  }
  tether::SetVerbose(verbose);
  if (StopRequested()) return kExitInterrupted;
  tether::Limits limits;
  limits.interrupted = &StopRequested();
  limits.memory = memory_limit;
  const tether::LimitsScope scope(limits);
  const int code = command();
  RequireStandardOutput();
  return code;
}

int Guarded(int argc, char** argv) {
  try {
    return Main(argc, argv);
  } catch (const tether::InputError& error) {
    for (const tether::Diagnostic& diagnostic : error.diagnostics())
      std::fprintf(stderr, "%s\n", diagnostic.ToString().c_str());
    return kExitBadInput;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "gave up: there is not enough memory\n");
    return kExitGaveUp;
  } catch (const tether::LimitReached& reached) {
    std::fprintf(stderr, "%s\n", reached.what());
    return reached.limit() == tether::Limit::kInterrupted ? kExitInterrupted : kExitGaveUp;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "internal error: %s\n", error.what());
    return kExitInternal;
  }
}

}  // namespace

int main(int argc, char** argv) {
  HoldClosedStreams();
  const int code = Guarded(argc, argv);
  FinishSignals();
  return StopRequested() ? kExitInterrupted : code;
}
