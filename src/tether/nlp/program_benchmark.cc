#include <benchmark/benchmark.h>

#include "testing/nlp/test_programs.h"
#include "tether/nlp/solver.h"
#include "tether/nlp/vector_view.h"

namespace tether::nlp {
namespace {

void BM_Assess(benchmark::State& state) {
  const testing::Example example = testing::KeyPoseChain(static_cast<int>(state.range(0)), 1);
  for (auto _ : state) benchmark::DoNotOptimize(Assess(example.program, example.guess));
}
BENCHMARK(BM_Assess)->Arg(3)->Arg(14);

/// One evaluation of the program as a backend sees it, with derivatives or without.
void BM_Evaluate(benchmark::State& state) {
  const testing::Example example = testing::KeyPoseChain(static_cast<int>(state.range(0)), 1);
  VectorView view(example.program, example.guess);
  Eigen::VectorXd x = view.start();
  for (auto _ : state) {
    x[0] += 1e-12;  // Otherwise the view answers from its cache.
    benchmark::DoNotOptimize(state.range(1) != 0 ? view.EvaluateDerivatives(x) : view.EvaluateValues(x));
  }
}
BENCHMARK(BM_Evaluate)->ArgsProduct({{3, 14}, {0, 1}})->ArgNames({"steps", "derivatives"});

void BM_Solve(benchmark::State& state) {
  const auto backend = static_cast<Backend>(state.range(0));
  const testing::Example example = testing::KeyPoseChain(static_cast<int>(state.range(1)), 1);
  Options options;
  options.max_iterations = 5000;
  Result result;
  for (auto _ : state) result = MakeSolver(backend)->Solve(example.program, example.guess, options);
  state.SetLabel(ToString(backend) + " " + ToString(result.status));
  state.counters["iterations"] = result.iterations;
  state.counters["evaluations"] = result.evaluations;
}
BENCHMARK(BM_Solve)
    ->Args({static_cast<int>(Backend::kNative), 3})
    ->Args({static_cast<int>(Backend::kNative), 14})
    ->Args({static_cast<int>(Backend::kIpopt), 3})
    ->Args({static_cast<int>(Backend::kNlopt), 3})
    ->Args({static_cast<int>(Backend::kIpopt), 14})
    ->Args({static_cast<int>(Backend::kNlopt), 14})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tether::nlp
