#include <cstdio>
#include <filesystem>

#include "apps/tether/commands.h"
#include "apps/tether/terminal.h"
#include "tether/bench/bench_control.h"
#include "tether/bench/bench_motion.h"
#include "tether/bench/bench_paced.h"
#include "tether/bench/bench_planning.h"
#include "tether/bench/bench_task.h"
#include "tether/bench/bench_tick.h"
#include "tether/bench/bench_tracking.h"
#include "tether/common/exit_code.h"
#include "tether/common/file.h"
#include "tether/common/output/output_header.h"
#include "tether/common/output/outputs.h"
#include "tether/common/text.h"
#include "tether/geometry/distance/geometry_bench.h"
#include "tether/planning/plan/plan_report.h"
#include "tether/robot/model.h"

namespace tether::app {
namespace {

std::string Column(const std::string& text, size_t width) {
  return text.size() >= width ? text + " " : text + std::string(width - text.size(), ' ');
}

std::string Actions(const planning::Plan& plan) {
  std::string text;
  for (const std::string& action : plan.actions) text += (text.empty() ? "" : " ") + action;
  return text;
}

void WriteResult(const BenchArguments& arguments, const Value& value) {
  if (!arguments.json.empty()) WriteOutput(arguments.json, WriteJson(value));
}

/// Paper A, Table I: both problems with both solvers, every candidate, failures included.
int BenchTable1(const BenchArguments& arguments) {
  const Terminal terminal(arguments.json == "-");
  Value rows = Value::Array();
  uint64_t seed = 0;
  for (const char* name : {"workspace_reach", "hanoi"}) {
    const std::string path =
        (std::filesystem::path(robot::DataDirectory()) / "scenarios" / name).string() + ".yaml";
    const scenario::Scenario scenario = scenario::LoadScenario(path);
    const auto task = scenario::MakeTask(scenario);
    seed = scenario.seed;
    terminal.Print(terminal.Bold(scenario.title));
    terminal.Print(terminal.Bold(Column("solver", 8) + Column("status", 12) + Column("cost", 10) +
                                 Column("mm", 9) + Column("mrad", 9) + Column("time (s)", 10) +
                                 Column("evals", 8) + "actions"));
    for (const char* solver : {"ipopt", "nlopt"}) {
      scenario::PlanningOverrides overrides;
      overrides.solver = solver;
      overrides.threads = 1;  // times of one solve at a time
      overrides.stop = arguments.stop;
      const planning::Problem problem = scenario::MakeProblem(scenario, scenario.scene, overrides);
      const auto print = [&](const planning::CandidateReport& candidate) {
        terminal.Print(Column(solver, 8) + Column(planning::ToString(candidate.status), 12) +
                       Column(Fixed(candidate.plan.cost, 4), 10) +
                       Column(Fixed(1e3 * candidate.max_violation_m, 3), 9) +
                       Column(Fixed(1e3 * candidate.max_violation_rad, 3), 9) +
                       Column(Fixed(candidate.optimize_s, 3), 10) +
                       Column(std::to_string(candidate.evaluations), 8) + Actions(candidate.plan));
        if (!candidate.reason.empty()) terminal.Print("        " + terminal.Dim(candidate.reason));
      };
      const planning::PlanReport report = planning::PlanTask(problem, *task, print);
      rows.Append(planning::WritePlanReport(report, scenario.title, seed).Set("solver", solver));
      if (report.status == planning::PlanStatus::kInterrupted) return kExitInterrupted;
    }
    terminal.Print("");
  }
  WriteResult(arguments, OutputHeader("tether.bench/1", seed).Set("name", "table1").Set("rows", rows));
  return kExitSuccess;
}

/// Signed distances, their time and the error that they show themselves, on 10,000 pose pairs per pair of
/// kinds.
int BenchGeometry(const BenchArguments& arguments) {
  const Terminal terminal(arguments.json == "-");
  Value rows = Value::Array();
  bool good = true;
  terminal.Print(terminal.Bold(Column("pair", 22) + Column("pairs", 8) + Column("overlapping", 13) +
                               Column("max error (m)", 16) + Column("bound (m)", 12) + "time (µs)"));
  const uint64_t seed = 1;
  for (const geometry::PairReport& pair : geometry::BenchmarkDistances(10000, seed)) {
    const auto number = [](double value) {
      char text[32];
      FormatInto(text, sizeof text, "%.1e", value);
      return std::string(text);
    };
    terminal.Print(Column(pair.kind_a + "-" + pair.kind_b, 22) + Column(std::to_string(pair.pairs), 8) +
                   Column(std::to_string(pair.overlapping), 13) + Column(number(pair.max_error), 16) +
                   Column(number(pair.bound()), 12) + Fixed(1e6 * pair.time_per_query, 3));
    good = good && pair.max_error <= pair.bound();
    rows.Append(Value::Object()
                    .Set("kinds", pair.kind_a + "-" + pair.kind_b)
                    .Set("pairs", pair.pairs)
                    .Set("overlapping", pair.overlapping)
                    .Set("max_error_m", pair.max_error)
                    .Set("bound_m", pair.bound())
                    .Set("time_per_query_s", pair.time_per_query));
  }
  WriteResult(arguments, OutputHeader("tether.bench/1", seed).Set("name", "geometry").Set("rows", rows));
  return good ? kExitSuccess : kExitFailed;
}

/// The native solver against IPOPT and NLopt on the same programs, and planning as a whole with each.
int BenchPlanning(const BenchArguments& arguments) {
  const Terminal terminal(arguments.json == "-");
  bench::PlanningBenchOptions options;
  options.scenarios = arguments.scenarios;
  options.solvers = arguments.solvers;
  options.repetitions = arguments.repetitions.value_or(options.repetitions);
  options.no_robot = arguments.no_robot;
  options.program = arguments.program;
  options.stop = arguments.stop;
  const bench::PlanningBench bench = bench::BenchmarkPlanning(
      options,
      [&](const bench::ProblemMeasurement& problem) { terminal.Print(bench::PlanningBenchTable(problem)); });
  WriteResult(arguments, bench::WritePlanningBench(bench));
  return bench.interrupted ? kExitInterrupted : kExitSuccess;
}

/// Ticks by the clock on the wall.
int BenchPaced(const BenchArguments& arguments) {
  const Terminal terminal(arguments.json == "-");
  bench::PacedBench bench;
  bench.seconds = *arguments.paced;
  bench = bench::BenchmarkPaced(bench);
  terminal.Print(std::to_string(bench.ticks) + " ticks at 1 kHz, " +
                 (bench.loaded ? "another process loading the other cores: " : "no other load: ") +
                 std::to_string(bench.over) + " (" + Fixed(100 * bench.share_over(), 3) +
                 " %) over their period; latest start " + Fixed(1e6 * bench.latest_start, 0) +
                 " µs, longest " + Fixed(1e6 * bench.longest, 0) + " µs");
  WriteResult(
      arguments,
      OutputHeader("tether.bench/1", 1).Set("name", "control").Set("paced", bench::WritePacedBench(bench)));
  return bench.share_over() <= 0.001 ? kExitSuccess : kExitFailed;
}

/// Following a circle with torques.
Value BenchTracking(const Terminal& terminal) {
  const bench::TrackingBench bench = bench::BenchmarkTracking();
  const auto print = [&](const std::string& name, const bench::TrackingFigures& figures) {
    terminal.Print(Column(name, 28) + Column(Fixed(1e3 * figures.error, 4), 13) +
                   Column(Fixed(1e3 * figures.worst, 4), 13) + Fixed(figures.work, 3));
  };
  terminal.Print("\n" + terminal.Bold(Column("a circle, 10 cm, 0.2 m/s", 28) + Column("mean (mm)", 13) +
                                      Column("worst (mm)", 13) + "work (J)"));
  print("operational_space", bench.operational_space);
  print("constrained_torque", bench.constrained);
  return bench::WriteTrackingBench(bench);
}

/// The QP solver of the control loop, and whole ticks of it.
int BenchControl(const BenchArguments& arguments) {
  if (arguments.paced) return BenchPaced(arguments);
  const Terminal terminal(arguments.json == "-");
  const bench::ControlBench bench = bench::BenchmarkControl();
  const auto print = [&](const std::string& name, const bench::Spread& quantiles) {
    terminal.Print(Column(name, 24) + Column(Fixed(1e6 * quantiles.median, 3), 13) +
                   Fixed(1e6 * quantiles.p99, 3));
  };
  terminal.Print(terminal.Bold(Column("QP, n = 7, m = 40", 24) + Column("median (µs)", 14) + "p99 (µs)"));
  print("cold", bench.cold);
  print("warm, smooth sequence", bench.warm);
  print("warm, unrelated", bench.warm_random);
  char kkt[32];
  FormatInto(kkt, sizeof kkt, "%.1e", bench.max_kkt);
  terminal.Print("largest relative KKT residual " + std::string(kkt) + ", unsolved " +
                 std::to_string(bench.unsolved));
  const int ticks = arguments.ticks.value_or(20000);
  terminal.Print("\n" + terminal.Bold(Column("one tick", 28) + Column("median (µs)", 14) +
                                      Column("p99 (µs)", 12) + Column("max (µs)", 12) + Column("> 1 ms", 10) +
                                      Column("max, CPU", 12) + Column("> 1 ms, CPU", 14) + "rows, mean"));
  Value tick_s = Value::Object(), rectangle_s = Value::Object();
  Value torque_s = Value::Object(), torque_rectangle_s = Value::Object();
  int faults = 0;
  const auto print_tick = [&](const std::string& name, const bench::TickBench& tick) {
    faults += tick.faults;
    terminal.Print(Column(name, 28) + Column(Fixed(1e6 * tick.median, 2), 13) +
                   Column(Fixed(1e6 * tick.p99, 2), 12) + Column(Fixed(1e6 * tick.max, 1), 12) +
                   Column(Fixed(100 * tick.over_1ms, 4) + " %", 10) +
                   Column(Fixed(1e6 * tick.cpu_max, 1), 12) +
                   Column(Fixed(100 * tick.cpu_over_1ms, 4) + " %", 14) + Fixed(tick.mean_rows, 1));
  };
  for (const char* robot : {"j2n6s300", "panda"}) {
    for (const bench::BenchRegion region : {bench::BenchRegion::kDisc, bench::BenchRegion::kRectangle}) {
      const bool disc = region == bench::BenchRegion::kDisc;
      const bench::TickBench tick = bench::BenchmarkTicks(robot, region, ticks, bench.seed);
      const std::string name = std::string(robot) + (disc ? ", disc" : ", rectangle");
      print_tick(name, tick);
      (disc ? tick_s : rectangle_s).Set(robot, bench::WriteTickBench(tick));
      const bench::TickBench torque = bench::BenchmarkTorqueTicks(robot, region, ticks, bench.seed);
      print_tick(name + ", torque", torque);
      (disc ? torque_s : torque_rectangle_s).Set(robot, bench::WriteTickBench(torque));
    }
  }
  const Value tracking = BenchTracking(terminal);
  WriteResult(arguments, bench::WriteControlBench(bench)
                             .Set("tracking", tracking)
                             .Set("tick_s", tick_s)
                             .Set("tick_rectangle_s", rectangle_s)
                             .Set("torque_tick_s", torque_s)
                             .Set("torque_tick_rectangle_s", torque_rectangle_s));
  return bench.unsolved == 0 && bench.max_kkt <= 1e-12 && faults == 0 ? kExitSuccess : kExitFailed;
}

/// The task search on scenes with regions.
int BenchTask(const BenchArguments& arguments) {
  const Terminal terminal(arguments.json == "-");
  bench::TaskBenchOptions options;
  options.stop = arguments.stop;
  terminal.Print(terminal.Dim("CPU time from formula and PDDL to the plan; a search gives up beyond " +
                              std::to_string(options.max_states) + " states"));
  const bench::TaskBench bench = bench::BenchmarkTasks(
      options, [&](const bench::TaskRow& row) { terminal.Print(bench::TaskRowText(row)); });
  WriteResult(arguments, bench::WriteTaskBench(bench));
  return bench.interrupted ? kExitInterrupted : kExitSuccess;
}

/// Paths for an arm, on problems of MotionBenchMaker.
int BenchMotion(const BenchArguments& arguments) {
  const Terminal terminal(arguments.json == "-");
  bench::MotionBenchOptions options;
  options.problems = arguments.problems;
  if (!arguments.robot.empty()) options.robot = arguments.robot;
  options.stop = arguments.stop;
  if (options.problems.empty()) {
    throw InputError("benchmark 'motion' needs problems",
                     "--problems DIR, a folder of MotionBenchMaker's scenes and requests");
  }
  const bench::MotionBench bench = bench::BenchmarkMotion(options, [&](const bench::MotionMeasurement& row) {
    if (!row.reason.empty()) terminal.Print(row.name + ": " + row.reason);
  });
  terminal.Print(bench::MotionBenchText(bench));
  WriteResult(arguments, bench::WriteMotionBench(bench));
  return bench.interrupted ? kExitInterrupted : bench.collisions() == 0 ? kExitSuccess : kExitFailed;
}

/// Options without effect are mistakes.
void RequireNoPlanningOptions(const BenchArguments& arguments) {
  Diagnostics diagnostics;
  const auto refuse = [&](bool given, const char* option) {
    if (given)
      diagnostics.Add({}, std::string(option) + " has no effect on benchmark '" + arguments.name + "'",
                      "with benchmark 'planning'");
  };
  refuse(!arguments.scenarios.empty(), "--scenario");
  refuse(!arguments.solvers.empty(), "--solver");
  refuse(arguments.repetitions.has_value(), "--repetitions");
  refuse(arguments.no_robot, "--no-robot");
  constexpr int kMostTicks = 10'000'000;
  constexpr double kMostPaced = 3600;
  if (arguments.ticks && *arguments.ticks > kMostTicks)
    diagnostics.Add({}, "--ticks is " + std::to_string(*arguments.ticks),
                    "up to " + std::to_string(kMostTicks));
  if (arguments.paced && !(*arguments.paced > 0 && *arguments.paced <= kMostPaced))
    diagnostics.Add({}, "--paced is " + Value(*arguments.paced).AsText(),
                    "a time in s, above 0, at most 3600");
  if (arguments.name != "control" && arguments.paced)
    diagnostics.Add({}, "--paced has no effect on benchmark '" + arguments.name + "'",
                    "with benchmark 'control'");
  if (arguments.name != "control" && arguments.ticks) {
    diagnostics.Add({}, "--ticks has no effect on benchmark '" + arguments.name + "'",
                    "with benchmark 'control'");
  }
  if (arguments.name != "motion" && (!arguments.problems.empty() || !arguments.robot.empty())) {
    diagnostics.Add({},
                    std::string(arguments.problems.empty() ? "--robot" : "--problems") +
                        " has no effect on benchmark '" + arguments.name + "'",
                    "with benchmark 'motion'");
  }
  diagnostics.ThrowIfAny();
}

}  // namespace

std::vector<std::pair<std::string, std::string>> BenchNames() {
  return {
      {"planning", "the native solver, IPOPT and NLopt on the same programs, and planning as a whole"},
      {"table1", "IPOPT and NLopt on both problems of paper A, as in its Table I"},
      {"geometry",
       "signed distances: time, and error by their own witness points, on 10,000 pairs per pair of shapes"},
      {"control", "the velocity controller: its QP cold and warm, residuals, and whole ticks on both robots"},
      {"task",
       "the task search on paper B's eq. (21), on regions cut into poses, and as tasks and scenes grow"},
      {"motion",
       "collision-free paths of an arm on MotionBenchMaker's problems: times, and checks per second"}};
}

int BenchCommand(const BenchArguments& arguments) {
  Outputs outputs;
  outputs.Add(arguments.json, "--json");
  outputs.Require(arguments.scenarios);
  if (arguments.name == "planning") return BenchPlanning(arguments);
  if (arguments.name == "table1" || arguments.name == "geometry" || arguments.name == "control" ||
      arguments.name == "task" || arguments.name == "motion") {
    RequireNoPlanningOptions(arguments);
  }
  if (arguments.name == "table1") return BenchTable1(arguments);
  if (arguments.name == "geometry") return BenchGeometry(arguments);
  if (arguments.name == "control") return BenchControl(arguments);
  if (arguments.name == "task") return BenchTask(arguments);
  if (arguments.name == "motion") return BenchMotion(arguments);
  std::vector<std::string> names;
  for (const auto& [name, text] : BenchNames()) names.push_back(name);
  throw InputError("unknown benchmark '" + arguments.name + "'", SuggestFrom(arguments.name, names));
}

}  // namespace tether::app
