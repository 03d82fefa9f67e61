#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tether/common/limits.h"
#include "tether/symbolic/grounding/task.h"
#include "tether/task/goal/conflict.h"
#include "tether/task/goal/product.h"
#include "tether/task/search/lifted_states.h"
#include "tether/task/search/state_graph.h"

namespace tether::task {

/// A candidate plan without geometry: ground actions, one after another.
struct Skeleton {
  std::vector<ActionId> actions;
  double cost = 0;  ///< Of the actions, in sum.
};

struct SkeletonOptions {
  int max_actions = 0;             ///< Length of the longest skeleton; 0: no limit.
  bool skip_revisits = true;       ///< Skip sequences that return to a symbolic state.
  size_t max_states = 20'000'000;  ///< Symbolic states held in memory, at most.
  bool blind = false;              ///< Dijkstra's algorithm instead of A* with landmark cuts.
  bool unit_costs = false;         ///< Each action costs 1, whatever the problem says.
  /// States that only exchange interchangeable objects are explored once; not if blind. Changes no result.
  bool symmetry = true;
  /// Expansions after which the estimates are made stronger, if not blind; 0: never. Changes no result.
  uint64_t strengthen_after = 250;
  /// Yield a cheapest skeleton as soon as it is proved to be one, before others of the same cost are
  /// searched.
  bool first_at_once = false;

  /// Throws InputError naming the field that is not valid.
  void Validate() const;
};

/// When to stop looking for the next skeleton. A search that was stopped can be continued.
struct SearchLimits : Limits {
  std::optional<double> max_cost = std::nullopt;  ///< Nothing more expensive for now.
};

enum class SearchStatus {
  kFound,
  kExhausted,    ///< Proved: there is no other skeleton (none without return to a state, if others are
                 ///< skipped).
  kPruned,       ///< None is left, but conflicts that were not proved ruled some out.
  kDepthLimit,   ///< None is left within `max_actions` and `max_cost`; there may be others.
  kStateLimit,   ///< `max_states` was reached.
  kTimeLimit,    ///< The deadline passed.
  kMemoryLimit,  ///< The process occupies as much as it may.
  kInterrupted,  ///< A stop was requested.
};

/// One sentence for people.
std::string_view Describe(SearchStatus status);

/// How a search ends at this limit.
SearchStatus StatusOf(Limit limit);

struct SearchOutcome {
  SearchStatus status = SearchStatus::kExhausted;
  std::optional<Skeleton> skeleton;  ///< With kFound.

  bool found() const { return status == SearchStatus::kFound; }
};

/// Finds the skeletons of a task one after another: every sequence of applicable actions that reaches the
/// goal at its last action and not before (paper A, section III), and, unless asked otherwise, never comes
/// back to a state.
///
/// Order: by cost, then by the first action in which two differ, in the task's order (but see
/// SkeletonOptions::first_at_once). None comes twice, and none within the limits is left out. To this end the
/// state graph is explored by A* only as far as skeletons of the next cost may lead, each state once;
/// distances to the goal within that part are exact for these skeletons, so the enumeration by increasing
/// cost meets dead ends only where a sequence would have to return to one of its states. Where the graph's
/// states are representatives, the enumeration goes through the states that they represent.
class SkeletonSearch {
 public:
  explicit SkeletonSearch(std::shared_ptr<const symbolic::Task> task, SkeletonOptions options = {});
  /// For a product, whose goal may be temporal. It must not be stepped by others meanwhile.
  explicit SkeletonSearch(std::unique_ptr<Product> product, SkeletonOptions options = {});

  /// The next skeleton, or why there is none.
  SearchOutcome Next(const SearchLimits& limits = {});

  /// From now on, yields nothing that begins with the conflict's prefix, or, if its last action fails
  /// anywhere, has that action. What was explored is kept: where many sequences have such an action, a new
  /// search whose product forbids it is faster.
  void AddConflict(const Conflict& conflict);

  /// Explores the rest of the product, beyond goals too; null when all of it is known. No Next() after this.
  std::optional<SearchStatus> ExploreAll(const SearchLimits& limits = {});

  const symbolic::Task& task() const { return product_->task(); }
  const Product& product() const { return *product_; }
  const StateGraph& graph() const { return graph_; }
  /// States expanded, and steps tried from them, so far: in the state graph and in the enumeration.
  uint64_t expanded() const { return graph_.expanded() + walked_; }
  uint64_t generated() const { return graph_.generated() + tried_; }

 private:
  struct Frame {
    int state = -1;
    std::span<const StateGraph::Edge> edges;  ///< Those not tried yet.
    int rule = -1;                            ///< Node of the tree of forbidden prefixes, -1 when off it.
    int64_t cost = 0;                         ///< So far.
  };

  std::optional<SearchStatus> Explore(const SearchLimits& limits);
  std::optional<SearchStatus> CheckLimits(const SearchLimits& limits, bool now);
  SearchStatus NothingLeft() const;
  bool IsForbidden(const std::vector<ActionId>& actions) const;
  void StartLevel(int64_t cost);
  /// The representative in the graph of a state of the walk.
  int Base(int state) const { return lifted_ ? lifted_->base(state) : state; }
  void Push(int state, int rule, int64_t cost);
  void Pop();
  int Follow(int rule, ActionId action) const;
  Skeleton MakeSkeleton(std::vector<ActionId> actions, int64_t cost) const;

  std::unique_ptr<Product> product_;
  SkeletonOptions options_;
  StateGraph graph_;
  std::unique_ptr<LiftedStates> lifted_;  ///< The states of the walk, where the graph has representatives.
  double unit_ = 1;                       ///< Of costs.
  bool every_action_costs_1_ = true;
  IndexedVector<int, int64_t> distance_;  ///< To the goal, per state of the graph.
  uint64_t distances_of_ = 0;             ///< StateGraph::closed() when the distances were computed.
  int64_t level_ = -1;                    ///< Cost of the skeletons that are being enumerated.
  int64_t next_level_ = 0;  ///< Least cost beyond `level_` that may have skeletons; kFar if none.
  bool enumerating_ = false;
  std::vector<Frame> path_;
  std::vector<ActionId> path_actions_;
  IndexedVector<int, bool> on_path_;            ///< Per state of the walk.
  std::optional<std::vector<ActionId>> first_;  ///< The one that came at once.
  bool may_come_at_once_ = false;
  bool too_long_ = false;  ///< `max_actions` cut a sequence off.

  std::map<std::pair<int, ActionId>, int>
      rules_;  ///< (node, action) → node of the tree of forbidden prefixes; 0 is the root.
  IndexedVector<int, bool> forbidden_{1, false};  ///< Per node of that tree.
  IndexedVector<ActionId, bool> never_;           ///< It fails anywhere. Empty: none does.
  bool pruned_unproved_ = false;
  uint64_t walked_ = 0, tried_ = 0, ticks_ = 0;
};

}  // namespace tether::task
