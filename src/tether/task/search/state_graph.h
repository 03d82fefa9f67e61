#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "tether/common/id.h"
#include "tether/task/goal/product.h"
#include "tether/task/heuristics/estimate.h"
#include "tether/task/search/state_table.h"
#include "tether/task/symmetry/symmetry.h"

namespace tether::task {

/// The states of a product that were reached so far, each once, explored by A*: best lower bound first (Hart,
/// Nilsson and Raphael, 1968). A state that is reached again at less cost is expanded again, because landmark
/// cuts are not consistent. Goal states are not expanded: a skeleton ends there.
///
/// With `symmetry`, states that differ only by an exchange of interchangeable objects are one: the graph's
/// states are representatives, and its edges lead to the representatives of an action's results.
class StateGraph {
 public:
  static constexpr int64_t kFar = std::numeric_limits<int64_t>::max();

  struct Edge {
    ActionId action;
    int target = -1;
  };
  struct Options {
    bool blind = false;       ///< Without a heuristic: Dijkstra's algorithm.
    bool unit_costs = false;  ///< Each action costs 1: breadth-first if blind.
    bool symmetry = false;    ///< States that only exchange objects are one.
    /// After this many expansions the estimates are strengthened, which needs about as much time again; never
    /// if 0.
    uint64_t strengthen_after = 250;
  };

  /// `product` must outlive the graph.
  StateGraph(Product& product, const Options& options);

  /// A lower bound on the cost of plans through states that are not expanded; kFar if there are none.
  int64_t bound();
  /// Expands the next state and returns it; bound() must not be kFar. A goal state is only noted.
  int ExpandNext();
  /// Expands a state that was not expanded, goal states too, to find all that is reachable; false when none
  /// is left. Not counted; costs are not valid afterwards.
  bool ExpandBeyondGoals();

  size_t states() const { return table_.size(); }
  /// Expansions so far, again and again counted; successors made.
  uint64_t expanded() const { return expanded_; }
  uint64_t generated() const { return generated_; }
  /// Calls of ExpandNext() so far, those that only noted a goal state too: GoalDistances() stay the same as
  /// long as this does.
  uint64_t closed() const { return closed_; }

  /// Null if no states are identified.
  const Symmetry* symmetry() const { return symmetry_.get(); }
  /// The number of the representative of `state`, which is overwritten by it; -1 if it was not reached.
  int Find(std::span<uint64_t> state) {
    if (symmetry_) symmetry_->Canonicalize(state);
    return table_.Find(state);
  }

  int64_t action_cost(ActionId action) const { return costs_[action]; }
  symbolic::StateView state(int index) const { return table_[index]; }
  bool is_goal(int state) const { return nodes_[state].is_goal; }
  bool is_closed(int state) const { return nodes_[state].is_closed; }
  /// The cheapest path found to `state`: its cost, and its actions.
  int64_t cost(int state) const { return nodes_[state].cost; }
  std::vector<ActionId> PathTo(int state);
  /// Least cost of the goal states met by ExpandNext(), kFar if there is none.
  int64_t goal_cost() const { return goal_cost_; }

  /// The actions from an expanded state, in the task's order; none from others. Call FindEdges() first.
  const Edge* begin_edges(int state) const { return edges_.data() + first_edge_[state]; }
  const Edge* end_edges(int state) const { return edges_.data() + end_edge_[state]; }
  /// Least cost from each state to a goal state over the expanded part, kFar if there is no path. Finds the
  /// edges too.
  IndexedVector<int, int64_t> GoalDistances();

 private:
  struct Node {
    int64_t cost = kFar;
    int64_t estimate = 0;
    int parent = -1;
    ActionId action;
    int landmark_count = 0;  ///< Numbers in landmarks_.
    int generation = 0;      ///< Of the estimate.
    size_t first_landmark = 0;
    bool is_goal = false;
    bool is_closed = false;
    bool has_edges = false;
    bool is_expanded = false;  ///< Once, at whatever cost.
  };
  struct Entry {
    int64_t bound, estimate;
    uint64_t number;  ///< Later ones first, except in a blind search.
    int state;
    int64_t cost;
  };
  struct Worse {
    bool operator()(const Entry& a, const Entry& b) const;
  };

  uint64_t NextNumber();
  void Push(int state, uint64_t number);
  void Strengthen();
  int64_t EstimateCost(symbolic::StateView state, Node& node, int parent, ActionId action, bool exchanged);
  /// `state` is overwritten by its representative.
  void Reach(std::span<uint64_t> state, int64_t cost, int parent, ActionId action);
  void Expand(int state);
  void FindEdges();

  Product& product_;
  Options options_;
  Estimate estimate_;
  std::unique_ptr<Symmetry> symmetry_;
  IndexedVector<ActionId, int64_t> costs_;
  StateTable table_;
  IndexedVector<int, Node> nodes_;
  std::vector<Entry> open_;  ///< A heap.
  uint64_t pushed_ = 0, expanded_ = 0, generated_ = 0, closed_ = 0;
  int64_t goal_cost_ = kFar;
  std::vector<int> mapped_;     ///< Landmarks of the state before, with objects exchanged.
  std::vector<int> landmarks_;  ///< Of the states' estimates, one after another.
  uint64_t strengthen_at_ = 0;  ///< Expansions.
  int beyond_ = 0;              ///< States before this one are expanded.
  std::vector<Edge> edges_;
  IndexedVector<int, size_t> first_edge_, end_edge_;
  symbolic::State scratch_, source_;
  std::vector<ActionId> applicable_;
};

}  // namespace tether::task
