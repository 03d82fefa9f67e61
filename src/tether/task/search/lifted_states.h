#pragma once

#include <deque>
#include <span>
#include <vector>

#include "tether/task/search/state_graph.h"

namespace tether::task {

/// The product's states where a graph's states are representatives: created as a walk reaches them, each
/// once, with its representative in the graph.
class LiftedStates {
 public:
  /// Both must outlive this. State 0 is the start, which must exist.
  LiftedStates(Product& product, StateGraph& graph);

  /// The representative of `state` in the graph.
  int base(int state) const { return base_[state]; }
  /// The actions from `state` in the task's order, if the graph has expanded its representative.
  std::span<const StateGraph::Edge> Edges(int state);

 private:
  int Insert(const symbolic::State& state);

  Product& product_;
  StateGraph& graph_;
  StateTable table_;
  IndexedVector<int, int> base_;
  std::deque<std::vector<StateGraph::Edge>> edges_;  ///< Empty: not made.
  symbolic::State source_, scratch_, image_;
  std::vector<ActionId> applicable_;
};

}  // namespace tether::task
