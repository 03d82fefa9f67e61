#include <algorithm>

#include "tether/bench/bench_planning.h"
#include "tether/common/output/output_header.h"
#include "tether/common/text.h"

namespace tether::bench {
namespace {

Value WriteSpread(const Spread& spread) {
  return Value::Object().Set("median", spread.median).Set("p99", spread.p99);
}

Value WriteSpread(const std::vector<double>& values) { return WriteSpread(SpreadOf(values)); }

Value Names(const std::vector<std::string>& words) {
  Value list = Value::Array();
  for (const std::string& word : words) list.Append(word);
  return list;
}

Value OrNull(const std::optional<double>& value) { return value ? Value(*value) : Value(); }

/// CPU time over the native solver's, by medians; none without that.
std::optional<double> Ratio(const Samples& samples, const Samples* native) {
  const double ours = native == nullptr ? 0 : SpreadOf(native->cpu).median;
  if (ours <= 0 || samples.cpu.empty()) return std::nullopt;
  return SpreadOf(samples.cpu).median / ours;
}

/// Shares of a solver's time, as far as it reports them: only the native one reports more than the
/// evaluation.
struct Shares {
  std::optional<double> evaluation, assembly, linear_algebra;
  double rest = 1;
};

Shares SharesOf(const SolverMeasurement& solver) {
  Shares shares;
  if (solver.solve_s <= 0) return shares;
  const auto take = [&](double seconds, std::optional<double>& share) {
    if (seconds <= 0) return;
    share = seconds / solver.solve_s;
    shares.rest -= *share;
  };
  take(solver.evaluation_s, shares.evaluation);
  take(solver.assembly_s, shares.assembly);
  take(solver.linear_algebra_s, shares.linear_algebra);
  return shares;
}

Value WritePrograms(const SolverMeasurement& solver) {
  Value programs = Value::Array();
  for (const ProgramMeasurement& program : solver.programs) {
    programs.Append(Value::Object()
                        .Set("actions", Names(program.actions))
                        .Set("status", nlp::ToString(program.result.status))
                        .Set("cost", program.result.cost)
                        .Set("max_violation_m", program.result.max_violation_m)
                        .Set("max_violation_rad", program.result.max_violation_rad)
                        .Set("iterations", program.result.iterations)
                        .Set("evaluations", program.result.evaluations)
                        .Set("solve_s", WriteSpread(program.solve.wall))
                        .Set("solve_cpu_s", WriteSpread(program.solve.cpu)));
  }
  return programs;
}

Value WriteWhole(const WholePlanning& planning, const WholePlanning* native) {
  Value value = Value::Object();
  value.Set("status", planning::ToString(planning.status)).Set("feasible", planning.feasible);
  value.Set("cost", planning.feasible > 0 ? Value(planning.cost) : Value());
  value.Set("max_violation_m", planning.max_violation_m).Set("max_violation_rad", planning.max_violation_rad);
  value.Set("total_s", WriteSpread(planning.total.wall)).Set("total_cpu_s", WriteSpread(planning.total.cpu));
  value.Set("read_s", WriteSpread(planning.read_s)).Set("search_s", WriteSpread(planning.search_s));
  value.Set("optimize_s", WriteSpread(planning.optimize.wall));
  value.Set("optimize_cpu_s", WriteSpread(planning.optimize.cpu));
  value.Set("ratio_to_native",
            OrNull(Ratio(planning.optimize, native == nullptr ? nullptr : &native->optimize)));
  return value;
}

Value WriteRow(const ProblemMeasurement& problem, const SolverMeasurement& solver) {
  const SolverMeasurement* native = problem.native();
  const Shares shares = SharesOf(solver);
  Value row = Value::Object();
  row.Set("problem", problem.title).Set("solver", nlp::ToString(solver.backend));
  row.Set("repetitions", static_cast<int>(solver.optimize.wall.size()));
  row.Set("optimize_s", WriteSpread(solver.optimize.wall));
  row.Set("optimize_cpu_s", WriteSpread(solver.optimize.cpu));
  row.Set("ratio_to_native", OrNull(Ratio(solver.optimize, native == nullptr ? nullptr : &native->optimize)));
  row.Set("solved", static_cast<int>(std::count_if(solver.programs.begin(), solver.programs.end(),
                                                   [](const auto& program) { return program.result.ok(); })));
  row.Set("cost", OrNull(solver.cost())).Set("cost_excess", problem.CostExcess(solver));
  row.Set("max_violation_m", solver.max_violation_m()).Set("max_violation_rad", solver.max_violation_rad());
  row.Set("iterations", solver.iterations()).Set("evaluations", solver.evaluations());
  row.Set("share", Value::Object()
                       .Set("evaluation", OrNull(shares.evaluation))
                       .Set("assembly", OrNull(shares.assembly))
                       .Set("linear_algebra", OrNull(shares.linear_algebra))
                       .Set("rest", shares.rest));
  row.Set("programs", WritePrograms(solver));
  row.Set("planning", WriteWhole(solver.planning, native == nullptr ? nullptr : &native->planning));
  return row;
}

Value WriteProblem(const ProblemMeasurement& problem) {
  Value value = Value::Object();
  value.Set("problem", problem.title).Set("scenario", problem.path).Set("seed", problem.seed);
  value.Set("candidates", problem.candidates).Set("key_poses", problem.key_poses);
  value.Set("variables", problem.variables).Set("rows", problem.rows);
  value.Set("build_s", WriteSpread(problem.build.wall)).Set("check_s", WriteSpread(problem.check.wall));
  if (!problem.process.wall.empty()) {
    value.Set("process_s", WriteSpread(problem.process.wall));
    value.Set("process_cpu_s", WriteSpread(problem.process.cpu)).Set("exit_code", problem.exit_code);
  }
  return value;
}

/// A line of cells, each right-aligned in its width but for the first.
class Line {
 public:
  explicit Line(const std::string& first) : text_("  " + first) {
    text_.resize(std::max<size_t>(10, text_.size()), ' ');
  }
  Line& Cell(const std::string& text, size_t width) {
    text_ += std::string(text.size() < width ? width - text.size() : 1, ' ') + text;
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

std::string Percent(const std::optional<double>& share) {
  return share ? Fixed(100 * *share, 0) + " %" : "-";
}

std::string Times(const std::optional<double>& ratio) { return ratio ? Fixed(*ratio, 1) + " x" : "-"; }

std::string Ms(double seconds) { return Fixed(1e3 * seconds, 2); }

std::string SolverLine(const ProblemMeasurement& problem, const SolverMeasurement& solver) {
  const SolverMeasurement* native = problem.native();
  const Shares shares = SharesOf(solver);
  const double excess = problem.CostExcess(solver);
  const std::optional<double> cost = solver.cost();
  const Spread wall = SpreadOf(solver.optimize.wall);
  return Line(nlp::ToString(solver.backend))
      .Cell(Ms(wall.median), 10)
      .Cell(Ms(wall.p99), 10)
      .Cell(Ms(SpreadOf(solver.optimize.cpu).median), 10)
      .Cell(Times(Ratio(solver.optimize, native == nullptr ? nullptr : &native->optimize)), 10)
      .Cell(cost ? Fixed(*cost, 4) : "-", 10)
      .Cell(excess < 1e9 ? Fixed(100 * excess, 2) + " %" : "unsolved", 10)
      .Cell(Fixed(1e3 * solver.max_violation_m(), 4), 9)
      .Cell(std::to_string(solver.iterations()), 7)
      .Cell(std::to_string(solver.evaluations()), 7)
      .Cell(Percent(shares.evaluation), 8)
      .Cell(Percent(shares.assembly), 10)
      .Cell(Percent(shares.linear_algebra), 9)
      .Cell(Percent(shares.rest), 7)
      .text();
}

std::string PlanningLine(const ProblemMeasurement& problem, const SolverMeasurement& solver) {
  const SolverMeasurement* native = problem.native();
  const WholePlanning& planning = solver.planning;
  const Spread wall = SpreadOf(planning.total.wall);
  return Line(nlp::ToString(solver.backend))
      .Cell(Ms(wall.median), 10)
      .Cell(Ms(wall.p99), 10)
      .Cell(Ms(SpreadOf(planning.total.cpu).median), 10)
      .Cell(Times(Ratio(planning.optimize, native == nullptr ? nullptr : &native->planning.optimize)), 10)
      .Cell(planning.feasible > 0 ? Fixed(planning.cost, 4) : "-", 10)
      .Cell(std::to_string(planning.feasible), 10)
      .Cell(Fixed(1e3 * planning.max_violation_m, 4), 9)
      .Cell(Ms(SpreadOf(planning.read_s).median), 14)
      .Cell(Ms(SpreadOf(planning.search_s).median), 10)
      .Cell(Ms(SpreadOf(planning.optimize.wall).median), 14)
      .text();
}

}  // namespace

Value WritePlanningBench(const PlanningBench& bench) {
  Value rows = Value::Array(), problems = Value::Array();
  for (const ProblemMeasurement& problem : bench.problems) {
    problems.Append(WriteProblem(problem));
    for (const SolverMeasurement& solver : problem.solvers) rows.Append(WriteRow(problem, solver));
  }
  const uint64_t seed = bench.problems.empty() ? 0 : bench.problems.front().seed;
  return OutputHeader("tether.bench/1", seed)
      .Set("name", "planning")
      .Set("complete", !bench.interrupted)
      .Set("no_robot", bench.no_robot)
      .Set("rows", rows)
      .Set("problems", problems);
}

std::string PlanningBenchTable(const ProblemMeasurement& problem) {
  std::string text = problem.title + ": " + std::to_string(problem.candidates) +
                     (problem.candidates == 1 ? " candidate" : " candidates") + ", the largest with " +
                     std::to_string(problem.key_poses) + " key poses, " + std::to_string(problem.variables) +
                     " variables and " + std::to_string(problem.rows) + " rows\n";
  text += "\n  The same programs, one per candidate, solved from the scene's own start (ms)\n";
  text += Line("solver")
              .Cell("median", 10)
              .Cell("p99", 10)
              .Cell("CPU", 10)
              .Cell("to native", 10)
              .Cell("best cost", 10)
              .Cell("excess", 10)
              .Cell("viol. mm", 9)
              .Cell("iter.", 7)
              .Cell("eval.", 7)
              .Cell("in eval.", 8)
              .Cell("assembly", 10)
              .Cell("lin.alg.", 9)
              .Cell("rest", 7)
              .text() +
          "\n";
  for (const SolverMeasurement& solver : problem.solvers) text += SolverLine(problem, solver) + "\n";
  text += "\n  Planning as a whole, files to plan, in one thread (ms)\n";
  text += Line("solver")
              .Cell("median", 10)
              .Cell("p99", 10)
              .Cell("CPU", 10)
              .Cell("to native", 10)
              .Cell("best cost", 10)
              .Cell("feasible", 10)
              .Cell("viol. mm", 9)
              .Cell("reading files", 14)
              .Cell("search", 10)
              .Cell("optimisation", 14)
              .text() +
          "\n";
  for (const SolverMeasurement& solver : problem.solvers) text += PlanningLine(problem, solver) + "\n";
  text += "\n  of the optimisation, building one program per candidate takes " +
          Ms(SpreadOf(problem.build.wall).median) + " ms, checking one plan of each " +
          Ms(SpreadOf(problem.check.wall).median) + " ms\n";
  if (!problem.process.wall.empty()) {
    const Spread wall = SpreadOf(problem.process.wall);
    text += "  the whole process of `tether plan`, native, one thread: median " + Ms(wall.median) +
            " ms, p99 " + Ms(wall.p99) + " ms, CPU " + Ms(SpreadOf(problem.process.cpu).median) + " ms\n";
  }
  return text;
}

}  // namespace tether::bench
