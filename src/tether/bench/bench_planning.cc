#include "tether/bench/bench_planning.h"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>

#include "tether/common/error.h"
#include "tether/common/stop.h"
#include "tether/planning/check/checker.h"
#include "tether/planning/modes/mode_assignment.h"
#include "tether/planning/program/program_builder.h"
#include "tether/scenario/problem.h"

namespace tether::bench {
namespace {

constexpr int kMostProcesses = 20;

std::vector<std::string> ScenarioFiles(const PlanningBenchOptions& options) {
  if (!options.scenarios.empty()) return options.scenarios;
  std::vector<std::string> files;
  for (const char* name : {"hanoi", "workspace_reach", "tool_use", "stacking"})
    files.push_back((std::filesystem::path(robot::DataDirectory()) / "scenarios" / name).string() + ".yaml");
  return files;
}

std::vector<nlp::Backend> Backends(const PlanningBenchOptions& options) {
  if (options.solvers.empty()) return {nlp::Backend::kNative, nlp::Backend::kIpopt, nlp::Backend::kNlopt};
  std::vector<nlp::Backend> backends;
  for (const std::string& name : options.solvers) {
    const nlp::Backend backend = nlp::ParseBackend(name);
    if (std::find(backends.begin(), backends.end(), backend) == backends.end()) backends.push_back(backend);
  }
  return backends;
}

scenario::PlanningOverrides Overrides(const PlanningBenchOptions& options, nlp::Backend backend) {
  scenario::PlanningOverrides overrides;
  overrides.solver = nlp::ToString(backend);
  overrides.max_plans = 0;
  overrides.threads = 1;
  overrides.time_limit_s = 0.0;
  overrides.no_robot = options.no_robot;
  overrides.stop = options.stop;
  return overrides;
}

/// A candidate's program with its first mode assignment that is not refuted.
struct CandidateProgram {
  std::vector<std::string> actions;
  planning::KeyPoseProgram key_poses;
};

std::optional<CandidateProgram> BuildFirst(const planning::SceneFacts& facts,
                                           const std::vector<std::string>& actions) {
  const std::vector<planning::BoundStep> steps = planning::BindSkeleton(facts.problem(), actions);
  planning::ProgramStart start;
  start.near = planning::kNear;
  planning::KeyPoseProgram first = planning::BuildProgram(facts, steps, {}, start);
  if (first.refutations.empty()) return CandidateProgram{actions, std::move(first)};
  for (const planning::ModeAssignment& modes :
       planning::FindModeAssignments(facts, steps, 16, planning::Limits(facts.problem().search)).open) {
    planning::KeyPoseProgram key_poses = planning::BuildProgram(facts, steps, modes.variant, start);
    if (key_poses.refutations.empty()) return CandidateProgram{actions, std::move(key_poses)};
  }
  return std::nullopt;
}

/// Calls `ask(index, repetition)` for each index, `counts[index]` times, with the calls for each spread
/// evenly over all calls. Ends early once `ask` returns false.
bool TakeTurns(const std::vector<int>& counts, const std::function<bool(size_t, int)>& ask) {
  const int rounds = *std::max_element(counts.begin(), counts.end());
  for (int round = 0; round < rounds; ++round) {
    for (size_t i = 0; i < counts.size(); ++i) {
      const auto due = [&](int r) {
        return static_cast<int>((static_cast<int64_t>(r) * counts[i] + rounds - 1) / rounds);
      };
      if (due(round + 1) > due(round) && !ask(i, due(round))) return false;
    }
  }
  return true;
}

/// Solves all programs once. False if that was interrupted.
bool SolveAll(const std::vector<CandidateProgram>& programs, const nlp::Options& options,
              SolverMeasurement& measurement) {
  const auto solver = nlp::MakeSolver(measurement.backend);
  measurement.programs.resize(programs.size());
  double wall_s = 0, cpu_s = 0;
  for (size_t i = 0; i < programs.size(); ++i) {
    ProgramMeasurement& program = measurement.programs[i];
    program.actions = programs[i].actions;
    const Stopwatch watch;
    nlp::Result result = solver->Solve(programs[i].key_poses.program, programs[i].key_poses.guess, options);
    if (result.status == nlp::Status::kInterrupted) return false;
    watch.AddTo(program.solve);
    wall_s += program.solve.wall.back();
    cpu_s += program.solve.cpu.back();
    measurement.solve_s += result.solve_s;
    measurement.evaluation_s += result.evaluation_s;
    measurement.assembly_s += result.assembly_s;
    measurement.linear_algebra_s += result.linear_algebra_s;
    program.result = std::move(result);
  }
  measurement.optimize.Add(wall_s, cpu_s);
  return true;
}

/// Files to plan, once. False if that was interrupted.
bool PlanOnce(const std::string& path, const scenario::PlanningOverrides& overrides, WholePlanning& whole) {
  const Stopwatch all;
  const scenario::Scenario scenario = scenario::LoadScenario(path);
  const auto task = scenario::MakeTask(scenario);
  const double read_s = all.wall_s();
  const planning::Problem problem = scenario::MakeProblem(scenario, scenario.scene, overrides);
  const Stopwatch planning_only;
  const planning::PlanReport report = planning::PlanTask(problem, *task);
  const double plan_cpu_s = planning_only.cpu_s();
  if (report.status == planning::PlanStatus::kInterrupted) return false;
  all.AddTo(whole.total);
  whole.optimize.Add(report.optimize_s, std::max(0.0, plan_cpu_s - report.search_s));
  whole.read_s.push_back(read_s);
  whole.search_s.push_back(report.search_s);
  whole.status = report.status;
  whole.feasible = 0;
  whole.max_violation_m = whole.max_violation_rad = 0;
  for (const planning::CandidateReport& candidate : report.candidates) {
    if (!candidate.feasible()) continue;
    ++whole.feasible;
    whole.max_violation_m = std::max(whole.max_violation_m, candidate.max_violation_m);
    whole.max_violation_rad = std::max(whole.max_violation_rad, candidate.max_violation_rad);
  }
  whole.cost = report.best() == nullptr ? 0 : report.best()->plan.cost;
  return true;
}

/// The problem of a measurement. The programs may refer to the facts.
struct Programs {
  std::unique_ptr<planning::SceneFacts> facts;
  std::vector<CandidateProgram> list;
};

/// Building all programs and checking all plans, outside of any solver; each repetition from nothing.
Programs MeasureBuilding(const planning::Problem& problem, const planning::PlanReport& report,
                         int repetitions, ProblemMeasurement& measurement) {
  Programs programs;
  for (int repetition = 0; repetition < repetitions; ++repetition) {
    programs.list.clear();
    const Stopwatch build;
    programs.facts = std::make_unique<planning::SceneFacts>(problem);
    for (const planning::CandidateReport& candidate : report.candidates) {
      if (candidate.plan.actions.empty()) continue;
      if (auto program = BuildFirst(*programs.facts, candidate.plan.actions))
        programs.list.push_back(std::move(*program));
    }
    build.AddTo(measurement.build);
    const Stopwatch check;
    for (const planning::CandidateReport& candidate : report.candidates) {
      if (!candidate.plan.steps.empty()) planning::CheckPlan(problem, candidate.plan);
    }
    check.AddTo(measurement.check);
  }
  for (const CandidateProgram& candidate : programs.list) {
    const nlp::Program& program = candidate.key_poses.program;
    measurement.key_poses = std::max(measurement.key_poses, program.num_poses());
    measurement.variables = std::max(measurement.variables, program.num_variables());
    measurement.rows = std::max(
        measurement.rows, program.num_rows(nlp::Role::kEquality) + program.num_rows(nlp::Role::kInequality));
  }
  return programs;
}

std::optional<ProblemMeasurement> MeasureProblem(const std::string& path,
                                                 const PlanningBenchOptions& options) {
  const std::vector<nlp::Backend> backends = Backends(options);
  const scenario::Scenario scenario = scenario::LoadScenario(path);
  const auto task = scenario::MakeTask(scenario);
  const planning::Problem problem =
      scenario::MakeProblem(scenario, scenario.scene, Overrides(options, nlp::Backend::kNative));
  const planning::PlanReport report = planning::PlanTask(problem, *task);
  if (report.status == planning::PlanStatus::kInterrupted) return std::nullopt;

  ProblemMeasurement measurement;
  measurement.title = scenario.title;
  measurement.path = path;
  measurement.seed = problem.search.seed;
  measurement.candidates = static_cast<int>(report.candidates.size());
  const Programs programs = MeasureBuilding(problem, report, options.repetitions, measurement);

  std::vector<int> counts;
  for (nlp::Backend backend : backends) {
    counts.push_back(Repetitions(backend, options.repetitions));
    measurement.solvers.emplace_back().backend = backend;
  }
  nlp::Options solver_options = problem.program.solver;
  solver_options.stop = options.stop;
  const bool finished = TakeTurns(counts,
                                  [&](size_t i, int) {
                                    return !IsStopped(options.stop) &&
                                           SolveAll(programs.list, solver_options, measurement.solvers[i]);
                                  }) &&
                        TakeTurns(counts, [&](size_t i, int) {
                          return !IsStopped(options.stop) && PlanOnce(path, Overrides(options, backends[i]),
                                                                      measurement.solvers[i].planning);
                        });
  if (!finished) return std::nullopt;

  if (!options.program.empty() && measurement.native() != nullptr) {
    std::vector<std::string> command{options.program, "plan", path, "--solver", "native", "--threads", "1"};
    if (options.no_robot) command.emplace_back("--no-robot");
    for (int i = 0; i < std::min(options.repetitions, kMostProcesses) && !IsStopped(options.stop); ++i)
      measurement.exit_code = TimeProcess(command, measurement.process);
  }
  if (IsStopped(options.stop)) return std::nullopt;
  return measurement;
}

}  // namespace

void PlanningBenchOptions::Validate() const {
  Diagnostics diagnostics;
  constexpr int kMostRepetitions = 1'000'000;
  if (repetitions > kMostRepetitions)
    diagnostics.Add({}, "--repetitions is " + std::to_string(repetitions),
                    "up to " + std::to_string(kMostRepetitions));
  if (repetitions < 1) {
    diagnostics.Add({}, "--repetitions is " + std::to_string(repetitions), "a whole number above zero");
  }
  for (const std::string& name : solvers) {
    try {
      nlp::ParseBackend(name);
    } catch (const InputError& error) {
      diagnostics.Add(error);
    }
  }
  diagnostics.ThrowIfAny();
}

int SolverMeasurement::iterations() const {
  int sum = 0;
  for (const ProgramMeasurement& program : programs) sum += program.result.iterations;
  return sum;
}

int SolverMeasurement::evaluations() const {
  int sum = 0;
  for (const ProgramMeasurement& program : programs) sum += program.result.evaluations;
  return sum;
}

double SolverMeasurement::max_violation_m() const {
  double largest = 0;
  for (const ProgramMeasurement& program : programs)
    if (program.result.ok()) largest = std::max(largest, program.result.max_violation_m);
  return largest;
}

double SolverMeasurement::max_violation_rad() const {
  double largest = 0;
  for (const ProgramMeasurement& program : programs)
    if (program.result.ok()) largest = std::max(largest, program.result.max_violation_rad);
  return largest;
}

std::optional<double> SolverMeasurement::cost() const {
  std::optional<double> least;
  for (const ProgramMeasurement& program : programs)
    if (program.result.ok()) least = std::min(least.value_or(program.result.cost), program.result.cost);
  return least;
}

const SolverMeasurement* ProblemMeasurement::native() const {
  for (const SolverMeasurement& solver : solvers)
    if (solver.backend == nlp::Backend::kNative) return &solver;
  return nullptr;
}

double ProblemMeasurement::CostExcess(const SolverMeasurement& solver) const {
  double excess = 0;
  for (size_t i = 0; i < solver.programs.size(); ++i) {
    std::optional<double> least;
    for (const SolverMeasurement& other : solvers) {
      const nlp::Result& result = other.programs[i].result;
      if (result.ok()) least = std::min(least.value_or(result.cost), result.cost);
    }
    const nlp::Result& result = solver.programs[i].result;
    if (!least) continue;
    if (!result.ok()) return std::numeric_limits<double>::infinity();
    if (*least > 0) excess = std::max(excess, result.cost / *least - 1);
  }
  return excess;
}

int Repetitions(nlp::Backend backend, int repetitions) {
  switch (backend) {
    case nlp::Backend::kNative:
      return repetitions;
    case nlp::Backend::kIpopt:
      return std::max(1, repetitions / 10);
    case nlp::Backend::kNlopt:
      return std::max(1, repetitions / 50);
  }
  return repetitions;
}

PlanningBench BenchmarkPlanning(const PlanningBenchOptions& options,
                                const std::function<void(const ProblemMeasurement&)>& on_problem) {
  options.Validate();
  PlanningBench bench;
  bench.repetitions = options.repetitions;
  bench.no_robot = options.no_robot;
  for (const std::string& path : ScenarioFiles(options)) {
    std::optional<ProblemMeasurement> measurement = MeasureProblem(path, options);
    if (!measurement) {
      bench.interrupted = true;
      break;
    }
    if (on_problem) on_problem(*measurement);
    bench.problems.push_back(std::move(*measurement));
  }
  return bench;
}

}  // namespace tether::bench
