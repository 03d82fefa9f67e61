#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tether/common/document/value.h"

namespace tether::bench {

/// One search of the benchmark.
struct TaskMeasurement {
  std::string algorithm;       ///< "astar"; "astar, all states": without symmetry; "dijkstra".
  std::optional<double> cost;  ///< Of the cheapest plan; none: not found within the limits.
  uint64_t expanded = 0, generated = 0;
  double seconds = 0;  ///< From the formula and the PDDL text to the plan.
};

/// One task of the benchmark with the measurements of each search.
struct TaskRow {
  std::string section;  ///< "eq. (21)", "abstractions", "tasks" or "scenes".
  std::string name;
  int items = 0, regions = 0, poses = 0;  ///< Poses per region; 0: regions as they are.
  int automaton_states = 0;               ///< Of the minimal automaton, where it is small; else 0.
  /// Reachable states of the product. Empty: not counted.
  std::optional<double> reachable = std::nullopt;
  std::vector<TaskMeasurement> searches = {};
};

struct TaskBenchOptions {
  int repetitions = 5;            ///< The fastest counts, of A* below 1 s.
  size_t max_states = 3'000'000;  ///< A search that holds more gives up.
  const std::atomic<bool>* stop = nullptr;
};

struct TaskBench {
  TaskBenchOptions options;
  std::vector<TaskRow> rows;
  bool interrupted = false;
};

/// The task search on the region domain: paper B's eq. (21); the same with regions cut into poses (He et al.,
/// ICRA 2015); conjunctions of 1 to 8 tasks F(a & X F b); 4 to 10 objects in 8 to 16 regions. The symbolic
/// part alone, on one thread. Calls `on_row` for each row as soon as it is measured.
TaskBench BenchmarkTasks(const TaskBenchOptions& options, const std::function<void(const TaskRow&)>& on_row);

/// Lines for people.
std::string TaskRowText(const TaskRow& row);
/// Format `tether.bench/1`.
Value WriteTaskBench(const TaskBench& bench);

/// The number of reachable states of the product, counted over representatives of symmetric states where that
/// is exact: when the images of the start are reachable too. None if there are more than `max_states`.
std::optional<double> CountReachable(const std::string& domain, const std::string& problem,
                                     const std::string& formula, size_t max_states);

}  // namespace tether::bench
