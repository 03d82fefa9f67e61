#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tether/symbolic/task.h"
#include "tether/task/conflict.h"
#include "tether/task/state_graph.h"

namespace tether::task {

/// A candidate plan without geometry: ground actions, one after another.
struct Skeleton {
  std::vector<int> actions;  ///< Indices into Task::actions().
  double cost = 0;           ///< The number of actions.
};

struct SkeletonOptions {
  int max_actions = 0;             ///< Longest skeleton; 0: no limit.
  bool skip_revisits = true;       ///< Skip sequences that come back to a symbolic state.
  size_t max_states = 20'000'000;  ///< Symbolic states held in memory, at most.

  /// Throws InputError naming the field that makes no sense.
  void Validate() const;
};

/// When to stop looking for the next skeleton. A search that was stopped can be continued.
struct SearchLimits {
  std::stop_token stop;
  std::optional<std::chrono::steady_clock::time_point> deadline;
  int max_actions = 0;  ///< Nothing longer for now, in addition to SkeletonOptions::max_actions; 0: no limit.
};

enum class SearchStatus {
  kFound,
  kExhausted,  ///< Proved: there is no other skeleton (of those that don't come back to a state, if these are
               ///< skipped).
  kPruned,     ///< None is left, but conflicts that were not proved ruled some out.
  kDepthLimit,   ///< None is left up to `max_actions`; there may be longer ones.
  kStateLimit,   ///< `max_states` was reached.
  kTimeLimit,    ///< The deadline passed.
  kInterrupted,  ///< A stop was requested.
};

/// One sentence for people.
std::string_view Describe(SearchStatus status);

struct SearchOutcome {
  SearchStatus status = SearchStatus::kExhausted;
  std::optional<Skeleton> skeleton;  ///< With kFound.

  bool found() const { return status == SearchStatus::kFound; }
};

/// Finds the skeletons of a task one after another: every sequence of applicable actions that reaches the
/// goal at its last action and not before (paper A, section III), and, unless asked otherwise, never comes
/// back to a state.
///
/// Order: by number of actions, then by the first action in which two differ, in the task's order. None comes
/// twice, and none within `max_actions` is left out. To this end the state graph is explored breadth first
/// only as far as the skeletons are long, each state once; distances to the goal within that part are exact
/// for skeletons of that length, so the enumeration by increasing length turns into blind alleys only where a
/// sequence would have to come back to one of its states.
class SkeletonSearch {
 public:
  explicit SkeletonSearch(std::shared_ptr<const symbolic::Task> task, SkeletonOptions options = {});

  /// The next skeleton, or why there is none.
  SearchOutcome Next(const SearchLimits& limits = {});

  /// From now on, yields nothing that begins with the conflict's prefix.
  void AddConflict(const Conflict& conflict);

  const symbolic::Task& task() const { return *task_; }
  /// States expanded, and steps tried from them, so far: in the state graph and in the enumeration.
  uint64_t expanded() const { return graph_.expanded() + walked_; }
  uint64_t generated() const { return graph_.generated() + tried_; }

 private:
  struct Frame {
    int state = -1;
    const StateGraph::Edge* next = nullptr;  ///< The edge to try next.
    int rule = -1;                           ///< Node of the tree of forbidden prefixes, -1 when off it.
  };

  std::optional<SearchStatus> Explore(const SearchLimits& limits);
  std::optional<SearchStatus> CheckLimits(const SearchLimits& limits, bool now);
  SearchStatus NothingLeft() const {
    return pruned_unproved_ ? SearchStatus::kPruned : SearchStatus::kExhausted;
  }
  void StartLength(int length);
  void Push(int state, int rule);
  void Pop();
  int Follow(int rule, int action) const;

  std::shared_ptr<const symbolic::Task> task_;
  SkeletonOptions options_;
  StateGraph graph_;
  std::vector<int> distance_;  ///< To the goal, per state.
  size_t distances_of_ = 0;    ///< Expanded states when the distances were computed.
  int length_ = -1;            ///< Of the skeletons that are being enumerated.
  int next_length_ = 0;        ///< Shortest length beyond `length_` that may have skeletons; kFar if none.
  bool enumerating_ = false;
  std::vector<Frame> path_;
  std::vector<int> path_actions_;
  std::vector<bool> on_path_;  ///< Per state.

  std::map<std::pair<int, int>, int>
      rules_;  ///< (node, action) → node of the tree of forbidden prefixes; 0 is the root.
  std::vector<bool> forbidden_{false};  ///< Per node of that tree.
  bool pruned_unproved_ = false;
  uint64_t walked_ = 0, tried_ = 0, ticks_ = 0;
};

}  // namespace tether::task
