#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "tether/symbolic/task.h"

namespace tether::task {

/// The states of a task that were reached so far, each once, with the actions between them, explored breadth
/// first. Goal states are not expanded: a skeleton ends there.
class StateGraph {
 public:
  static constexpr int kFar = std::numeric_limits<int>::max();

  struct Edge {
    int action = -1;
    int target = -1;
  };

  explicit StateGraph(std::shared_ptr<const symbolic::Task> task);

  /// Expands the next state in breadth-first order; none may be left unexpanded.
  void ExpandNext();
  /// States that were not expanded yet; 0 when the reachable space is known.
  size_t frontier() const { return depth_.size() - expanded_; }
  /// Actions from the initial state to the next state to be expanded: states nearer than that are all
  /// expanded.
  int frontier_depth() const { return depth_[expanded_]; }

  size_t states() const { return depth_.size(); }
  size_t expanded() const { return expanded_; }
  uint64_t generated() const { return edges_.size(); }

  int depth(int state) const { return depth_[static_cast<size_t>(state)]; }
  bool is_goal(int state) const { return goal_[static_cast<size_t>(state)]; }
  bool has_goal() const { return has_goal_; }
  /// The actions from a state; none while it is not expanded. Expanding invalidates the pointers.
  const Edge* begin_edges(int state) const { return EdgeFrom(static_cast<size_t>(state)); }
  const Edge* end_edges(int state) const { return EdgeFrom(static_cast<size_t>(state) + 1); }
  symbolic::StateView state(int index) const {
    return {words_.data() + static_cast<size_t>(index) * width_, width_};
  }

  /// Fewest actions from each state to a goal state over the expanded part, kFar if there is no way.
  std::vector<int> GoalDistances() const;

 private:
  int Insert(symbolic::StateView state, int depth);
  void Grow();
  const Edge* EdgeFrom(size_t state) const {
    return edges_.data() + (state < first_edge_.size() ? first_edge_[state] : edges_.size());
  }

  std::shared_ptr<const symbolic::Task> task_;
  size_t width_;
  std::vector<uint64_t> words_;
  std::vector<int> depth_;
  std::vector<bool> goal_;
  bool has_goal_ = false;
  size_t expanded_ = 0;
  std::vector<size_t> first_edge_;  ///< Of expanded states; they are expanded in the order of their numbers.
  std::vector<Edge> edges_;
  std::vector<int> slots_;  ///< Open addressing: state numbers, -1 free.
  symbolic::State scratch_;
};

}  // namespace tether::task
