#pragma once

#include <atomic>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "tether/common/file.h"
#include "tether/common/limits.h"
#include "tether/symbolic/grounding/task.h"
#include "tether/task/search/skeleton.h"

namespace tether::app {

struct TaskArguments {
  std::string domain;                ///< PDDL file.
  std::string problem;               ///< PDDL file.
  std::string goal;                  ///< Temporal formula in place of the problem's goal; empty: that.
  std::string semantics = "cosafe";  ///< Of the formula; or "ltlf".
  std::string search = "astar";      ///< Or "greedy", "dijkstra", "bfs".
  int max_plans = 1;
  double time_limit_s = 0;                    ///< Of everything together; 0: no limit.
  size_t memory_limit = kDefaultMemoryLimit;  ///< Bytes; 0: no limit.
  std::string json;                           ///< File for the report, or "-"; empty: none.
  const std::atomic<bool>* stop = nullptr;

  /// Their clock starts now.
  Limits MakeLimits() const;
};

/// What a task search found.
struct TaskReport {
  task::SearchStatus ended = task::SearchStatus::kExhausted;  ///< Why there are not more plans.
  bool unsatisfiable = false;                                 ///< The temporal goal holds of no word at all.
  bool grounded = true;                                       ///< Otherwise a limit was reached before.
  bool complete = false;             ///< No plan that was asked for is missing because of a limit.
  std::deque<task::Skeleton> plans;  ///< Grows without copies.
  uint64_t expanded = 0, generated = 0;
  std::optional<uint64_t> reachable;    ///< States of the product, where all of them were explored.
  std::optional<int> automaton_states;  ///< Those the search met, where the goal is temporal.
  double parse_s = 0, ground_s = 0, search_s = 0;
};

/// Searches `task` for plans. Throws InputError for arguments that are not valid.
TaskReport SearchTask(std::shared_ptr<const symbolic::Task> task, const TaskArguments& arguments,
                      const Limits& limits);

/// Format `tether.task_report/1`, piece by piece; `task` is null if grounding came to no end.
void WriteTaskReport(const TaskReport& report, const symbolic::Problem& problem, const symbolic::Task* task,
                     const TaskArguments& arguments, const TextSink& sink);

/// `tether task`: prints the plans and returns the exit code. Throws InputError for bad input.
int TaskCommand(const TaskArguments& arguments);

}  // namespace tether::app
