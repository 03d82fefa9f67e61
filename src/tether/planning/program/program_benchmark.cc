#include "tether/planning/program/program_builder.h"

#include <algorithm>
#include <cstddef>
#include <ctime>

#include <benchmark/benchmark.h>

#include "testing/common/heap_counter.h"
#include "testing/planning/test_scene.h"

namespace tether::planning {
namespace {

using Eigen::Vector3d;

/// Heap allocations since its construction, per iteration of the benchmark.
class HeapWatch {
 public:
  void Report(benchmark::State& state) const {
    const auto per_iteration = [&](long now, long before) {
      return benchmark::Counter(static_cast<double>(now - before) / static_cast<double>(state.iterations()));
    };
    state.counters["allocations"] = per_iteration(heap_allocations, allocations_);
    state.counters["allocated_bytes"] = per_iteration(static_cast<long>(heap_bytes), bytes_);
  }

 private:
  long allocations_ = heap_allocations;
  long bytes_ = static_cast<long>(heap_bytes);
};

/// A tower of `blocks` cubes of 3.5 to 7 cm, the smallest on top, on the last of three plates.
scene::Scene HanoiScene(int blocks) {
  scene::Scene scene;
  for (int plate = 0; plate < 3; ++plate) {
    scene::Object object;
    object.name = "plate_" + std::to_string(plate);
    object.shape = geometry::Shape(geometry::Box{{0.17, 0.17, 0.07}});
    object.parent = scene::kWorld;
    object.X_ParentObject = math::Pose(Vector3d(0.6, 0.2 * (1 - plate), 0));
    scene.objects.push_back(std::move(object));
  }
  std::string below = "plate_2";
  double height_below = 0.07;
  for (int block = blocks - 1; block >= 0; --block) {
    const double size = 0.07 - 0.035 * (blocks - 1 - block) / std::max(1, blocks - 1);
    scene::Object object;
    object.name = "block_" + std::to_string(block);
    object.shape = geometry::Shape(geometry::Box{{size, size, size}});
    object.parent = below;
    object.X_ParentObject = math::Pose(Vector3d(0, 0, 0.5 * (height_below + size)));
    object.mass = 0.1;
    scene.objects.push_back(object);
    below = object.name;
    height_below = size;
  }
  scene.robots.push_back({"panda", "panda", {0, -0.5236, 0, -2.6180, 0, 2.0944, 0}, "world", {}});
  return scene;
}

/// The shortest solution: moves the `blocks` smallest from plate `from` to plate `to`. `at` holds the plate
/// of each block.
void MoveTower(int blocks, int to, std::vector<int>& at, std::vector<std::string>& actions) {
  if (blocks == 0) return;
  const int block = blocks - 1, from = at[block];
  MoveTower(block, 3 - from - to, at, actions);
  at[block] = to;
  std::string below = "plate_" + std::to_string(to);
  for (size_t larger = at.size() - 1; larger > static_cast<size_t>(block); --larger)
    if (at[larger] == to) below = "block_" + std::to_string(larger);
  const std::string name = "block_" + std::to_string(block);
  actions.push_back("pick(" + name + ")");
  actions.push_back("place(" + name + "," + below + ")");
  MoveTower(block, to, at, actions);
}

/// Of Workspace Reach for 0 blocks, else of the tower of Hanoi.
std::vector<std::string> Actions(int blocks) {
  if (blocks == 0) {
    return {"pick(hook)", "push(hook,box,table)", "place(hook,table)", "pick(box)", "place(box,shelf)"};
  }
  std::vector<std::string> actions;
  std::vector<int> at(blocks, 2);
  MoveTower(blocks, 1, at, actions);
  return actions;
}

/// A problem, one of its skeletons, and the program of that.
struct Example {
  explicit Example(int blocks)
      : problem(PandaProblem(blocks == 0 ? ReachScene() : HanoiScene(blocks))), actions(Actions(blocks)) {}

  Problem problem;
  SceneFacts facts{problem};
  std::vector<std::string> actions;
  std::vector<BoundStep> steps = BindSkeleton(problem, actions);
  KeyPoseProgram key_poses = BuildProgram(facts, steps);
};

void Describe(const Example& example, benchmark::State& state) {
  const nlp::Program& program = example.key_poses.program;
  state.counters["steps"] = program.num_poses();
  state.counters["rows"] = program.num_rows(nlp::Role::kEquality) + program.num_rows(nlp::Role::kInequality);
  state.SetLabel(state.range(0) == 0 ? "reach" : "hanoi-" + std::to_string(state.range(0)));
  if (!example.key_poses.refutations.empty())
    state.SkipWithError(example.key_poses.refutations.front().c_str());
}

void Problems(benchmark::internal::Benchmark* benchmark) {
  for (int blocks : {0, 3, 4, 5}) benchmark->Arg(blocks);
  benchmark->ArgName("blocks")->Unit(benchmark::kMicrosecond);
}

void BM_BindSkeleton(benchmark::State& state) {
  const Example example(static_cast<int>(state.range(0)));
  Describe(example, state);
  const HeapWatch heap;
  for (auto _ : state) benchmark::DoNotOptimize(BindSkeleton(example.problem, example.actions));
  heap.Report(state);
}
BENCHMARK(BM_BindSkeleton)->Apply(Problems);

/// A second program of the same problem: the scene's memo is filled.
void BM_BuildProgram(benchmark::State& state) {
  const Example example(static_cast<int>(state.range(0)));
  Describe(example, state);
  const HeapWatch heap;
  for (auto _ : state) benchmark::DoNotOptimize(BuildProgram(example.facts, example.steps));
  heap.Report(state);
}
BENCHMARK(BM_BuildProgram)->Apply(Problems);

/// Every residual once at the guess, with derivatives (1) or without (0).
void BM_EvaluateProgram(benchmark::State& state) {
  const Example example(static_cast<int>(state.range(0)));
  Describe(example, state);
  const nlp::Program& program = example.key_poses.program;
  std::vector<Eigen::VectorXd> rows;
  std::vector<Eigen::MatrixXd> jacobians;
  for (const nlp::Term& term : program.terms()) {
    int columns = 0;
    for (nlp::BlockRef block : term.residual->blocks()) columns += program.TangentSize(block);
    rows.emplace_back(term.residual->size());
    jacobians.emplace_back(term.residual->size(), columns);
  }
  const HeapWatch heap;
  for (auto _ : state) {
    for (size_t i = 0; i < rows.size(); ++i) {
      nlp::JacobianRef J(jacobians[i]);
      program.terms()[i].residual->Evaluate(example.key_poses.guess, rows[i],
                                            state.range(1) != 0 ? &J : nullptr);
    }
    benchmark::ClobberMemory();
  }
  heap.Report(state);
}
BENCHMARK(BM_EvaluateProgram)
    ->ArgsProduct({{0, 3, 4, 5}, {0, 1}})
    ->ArgNames({"blocks", "derivatives"})
    ->Unit(benchmark::kMicrosecond);

double ThreadSeconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// One step of the native solver from the scene's own start: the CPU time of a solve that ends after a few
/// iterations, less that of one that ends after the first, per iteration more. The first holds the set-up,
/// and its end lists more violations, which is why a step may have less than no allocations.
void BM_NativeStep(benchmark::State& state) {
  const Example example(static_cast<int>(state.range(0)));
  Describe(example, state);
  const auto solver = nlp::MakeSolver(nlp::Backend::kNative);
  nlp::Options options = example.problem.program.solver;
  struct Total {
    double seconds = 0, allocations = 0;
    int iterations = 0;
  };
  const auto solve = [&](int iterations) {
    options.max_iterations = iterations;
    const long allocations_before = heap_allocations;
    const double begin = ThreadSeconds();
    const nlp::Result result = solver->Solve(example.key_poses.program, example.key_poses.guess, options);
    return Total{ThreadSeconds() - begin, static_cast<double>(heap_allocations - allocations_before),
                 result.iterations};
  };
  Total first, further;
  for (auto _ : state) {
    const Total one = solve(1), more = solve(3);
    first.seconds += one.seconds;
    first.allocations += one.allocations;
    further.seconds += more.seconds - one.seconds;
    further.allocations += more.allocations - one.allocations;
    further.iterations += more.iterations - one.iterations;
  }
  const double solves = static_cast<double>(state.iterations());
  const double steps = std::max(1, further.iterations);
  state.counters["first_us"] = 1e6 * first.seconds / solves;
  state.counters["step_us"] = 1e6 * further.seconds / steps;
  state.counters["allocations_first"] = first.allocations / solves;
  state.counters["allocations_step"] = further.allocations / steps;
}
BENCHMARK(BM_NativeStep)->Apply(Problems);

/// From the scene's own start to the end.
void BM_Solve(benchmark::State& state) {
  const Example example(static_cast<int>(state.range(0)));
  Describe(example, state);
  const auto solver = nlp::MakeSolver(nlp::Backend::kNative);
  const HeapWatch heap;
  nlp::Result result;
  for (auto _ : state)
    result =
        solver->Solve(example.key_poses.program, example.key_poses.guess, example.problem.program.solver);
  heap.Report(state);
  state.counters["iterations"] = result.iterations;
  if (!result.ok()) state.SkipWithError(result.Summary().c_str());
}
BENCHMARK(BM_Solve)->Apply(Problems);

}  // namespace
}  // namespace tether::planning
