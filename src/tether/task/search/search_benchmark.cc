#include <benchmark/benchmark.h>

#include "testing/symbolic/domains.h"
#include "tether/task/search/greedy.h"
#include "tether/task/search/skeleton.h"

namespace tether::task {
namespace {

namespace domains = symbolic::domains;
using Make = std::shared_ptr<const symbolic::Problem> (*)();

std::shared_ptr<const symbolic::Problem> Gripper4() { return domains::Gripper(4); }
std::shared_ptr<const symbolic::Problem> Gripper8() { return domains::Gripper(8); }
std::shared_ptr<const symbolic::Problem> Gripper12() { return domains::Gripper(12); }
std::shared_ptr<const symbolic::Problem> Gripper40() { return domains::Gripper(40); }

/// From the parsed problem to a plan proved to be cheapest.
void BM_Cheapest(benchmark::State& state, Make make, bool blind) {
  const auto problem = make();
  SearchOutcome outcome;
  for (auto _ : state) {
    SkeletonSearch search(symbolic::Task::Ground(problem), {.blind = blind, .first_at_once = true});
    outcome = search.Next();
    state.counters["expanded"] = static_cast<double>(search.graph().expanded());
  }
  state.counters["cost"] = outcome.skeleton->cost;
}
BENCHMARK_CAPTURE(BM_Cheapest, blocks_8_0, domains::Blocks8, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Cheapest, blocks_8_0_blind, domains::Blocks8, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Cheapest, blocks_10_0, domains::Blocks10, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Cheapest, logistics_4_0, domains::Logistics4, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Cheapest, logistics_6_0, domains::Logistics6, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Cheapest, gripper_4, Gripper4, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Cheapest, gripper_8, Gripper8, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Cheapest, gripper_12, Gripper12, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Cheapest, depot, domains::Depot, false)->Unit(benchmark::kMillisecond);

void BM_Greedy(benchmark::State& state, Make make) {
  const auto problem = make();
  GreedyResult result;
  for (auto _ : state) {
    Product product(symbolic::Task::Ground(problem));
    result = FindGreedily(product);
  }
  state.counters["expanded"] = static_cast<double>(result.expanded);
  state.counters["cost"] = result.skeleton->cost;
}
BENCHMARK_CAPTURE(BM_Greedy, blocks_10_0, domains::Blocks10)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Greedy, logistics_6_0, domains::Logistics6)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Greedy, gripper_40, Gripper40)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tether::task
