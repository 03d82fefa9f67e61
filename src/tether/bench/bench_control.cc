#include "tether/bench/bench_control.h"

#include <algorithm>
#include <chrono>
#include <vector>

#include "tether/common/output/output_header.h"
#include "tether/qp/example_problems.h"
#include "tether/qp/kkt.h"
#include "tether/qp/solver.h"

namespace tether::bench {
namespace {

/// The number of ticks between jumps of a smooth sequence, and the time between ticks, s.
constexpr int kSequence = 500;
constexpr double kTick = 0.005;

std::vector<qp::Problem> MakeProblems(const ControlBench& bench, bool smooth) {
  qp::ControlSequence sequence(bench.variables, bench.rows, bench.seed);
  std::vector<qp::Problem> problems;
  for (int i = 0; i < bench.problems; ++i) {
    if (!smooth || i % kSequence == 0) sequence.Jump();
    problems.emplace_back(bench.variables, 0, bench.rows);
    sequence.Next(kTick, problems.back());
  }
  return problems;
}

/// Appends the time of each problem.
void Measure(const std::vector<qp::Problem>& problems, qp::Start start, ControlBench& bench,
             std::vector<double>& times_s) {
  using Clock = std::chrono::steady_clock;
  qp::Solver solver(bench.variables, 0, bench.rows);
  qp::Problem problem(bench.variables, 0, bench.rows);
  std::vector<std::vector<double>> passes(problems.size());
  for (int pass = 0; pass < bench.passes; ++pass) {
    solver.Reset();
    for (size_t i = 0; i < problems.size(); ++i) {
      problem = problems[i];
      const Clock::time_point before = Clock::now();
      const qp::Status status = solver.Solve(problem, start);
      const Clock::time_point after = Clock::now();
      passes[i].push_back(std::chrono::duration<double>(after - before).count());
      if (pass > 0) continue;
      if (status == qp::Status::kSolved) {
        const qp::KktResidual residual = qp::ComputeKktResidual(problem, solver.x(), solver.active());
        bench.max_kkt = std::max(bench.max_kkt, residual.largest());
      } else {
        ++bench.unsolved;
      }
      if (start == qp::Start::kCold) bench.mean_active += 0.5 * solver.active().size() / bench.problems;
    }
  }
  for (const std::vector<double>& times : passes) times_s.push_back(Quantile(times, 0.5));
}

Value WriteSpread(const Spread& spread) {
  return Value::Object().Set("median", spread.median).Set("p99", spread.p99);
}

}  // namespace

ControlBench BenchmarkControl(ControlBench bench) {
  const std::vector<qp::Problem> smooth = MakeProblems(bench, true), random = MakeProblems(bench, false);
  std::vector<double> cold_s, warm_s, warm_random_s;
  Measure(smooth, qp::Start::kCold, bench, cold_s);
  Measure(random, qp::Start::kCold, bench, cold_s);
  Measure(smooth, qp::Start::kWarm, bench, warm_s);
  Measure(random, qp::Start::kWarm, bench, warm_random_s);
  bench.cold = SpreadOf(std::move(cold_s));
  bench.warm = SpreadOf(std::move(warm_s));
  bench.warm_random = SpreadOf(std::move(warm_random_s));
  return bench;
}

Value WriteControlBench(const ControlBench& bench) {
  return OutputHeader("tether.bench/1", bench.seed)
      .Set("name", "control")
      .Set("qp", Value::Object()
                     .Set("variables", bench.variables)
                     .Set("rows", bench.rows)
                     .Set("problems", bench.problems)
                     .Set("passes", bench.passes)
                     .Set("mean_active", bench.mean_active)
                     .Set("cold_s", WriteSpread(bench.cold))
                     .Set("warm_s", WriteSpread(bench.warm))
                     .Set("warm_random_s", WriteSpread(bench.warm_random))
                     .Set("max_kkt", bench.max_kkt)
                     .Set("unsolved", bench.unsolved));
}

}  // namespace tether::bench
