#include <benchmark/benchmark.h>

#include <vector>

#include "tether/qp/example_problems.h"
#include "tether/qp/hierarchy.h"
#include "tether/qp/solver.h"

namespace tether::qp {
namespace {

constexpr int kProblems = 1000;

/// One problem after another; the time includes copying it to where a controller would have written it, which
/// BM_Copy measures.
void Run(benchmark::State& state, const SolverOptions& options, Start start, bool solve) {
  const int n = static_cast<int>(state.range(0)), m = static_cast<int>(state.range(1));
  const bool jumps = state.range(2) != 0;
  ControlSequence sequence(n, m, 1);
  std::vector<Problem> problems(kProblems, Problem(n, 0, m));
  for (Problem& problem : problems) {
    if (jumps) sequence.Jump();
    sequence.Next(0.005, problem);
  }
  Solver solver(n, 0, m, options);
  Problem problem(n, 0, m);
  size_t next = 0;
  long iterations = 0;
  for (auto _ : state) {
    problem = problems[next++ % kProblems];
    if (solve) benchmark::DoNotOptimize(solver.Solve(problem, start));
    iterations += solver.iterations();
  }
  state.counters["iterations"] =
      benchmark::Counter(static_cast<double>(iterations), benchmark::Counter::kAvgIterations);
}

void BM_Copy(benchmark::State& state) { Run(state, {}, Start::kCold, false); }
void BM_Cold(benchmark::State& state) { Run(state, {}, Start::kCold, true); }
void BM_Warm(benchmark::State& state) { Run(state, {}, Start::kWarm, true); }
void BM_ColdBaseline(benchmark::State& state) {
  SolverOptions options;
  options.instructions = Instructions::kBaseline;
  Run(state, options, Start::kCold, true);
}

void Sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgsProduct({{7}, {40, 200}, {0, 1}})->ArgsProduct({{6, 12, 20}, {40}, {0}});
  benchmark->ArgNames({"n", "m", "jumps"});
}
BENCHMARK(BM_Copy)->Apply(Sizes);
BENCHMARK(BM_Cold)->Apply(Sizes);
BENCHMARK(BM_ColdBaseline)->Apply(Sizes);
BENCHMARK(BM_Warm)->Apply(Sizes);

/// Two walls 1 cm too close, among forty rows.
void BM_Conflict(benchmark::State& state) {
  ControlSequence sequence(7, 40, 1);
  Problem problem(7, 0, 40);
  sequence.Next(0, problem);
  problem.A().row(1) = -problem.A().row(0);
  problem.lower()[0] = problem.lower()[1] = 0.005;
  const std::vector<int> levels(40, 1);
  HierarchySolver solver(7, 0, 40);
  for (auto _ : state) benchmark::DoNotOptimize(solver.Solve(problem, levels));
  state.counters["solves"] = solver.solves();
}
BENCHMARK(BM_Conflict);

}  // namespace
}  // namespace tether::qp
