#include "tether/task/search/lifted_states.h"

namespace tether::task {

LiftedStates::LiftedStates(Product& product, StateGraph& graph)
    : product_(product), graph_(graph), table_(product.words()), scratch_(product.words()) {
  Insert(*product.Start());
}

int LiftedStates::Insert(const symbolic::State& state) {
  bool is_new = false;
  const int index = table_.Insert(state, is_new);
  if (is_new) {
    image_ = state;
    base_.push_back(graph_.Find(image_));
    edges_.emplace_back();
  }
  return index;
}

std::span<const StateGraph::Edge> LiftedStates::Edges(int state) {
  const int standing = base(state);
  if (!graph_.is_closed(standing) || graph_.is_goal(standing)) return {};
  if (edges_[ToIndex(state)].empty()) {
    const symbolic::StateView view = table_[state];
    source_.assign(view.begin(), view.end());
    product_.FindApplicable(source_, applicable_);
    std::vector<StateGraph::Edge> edges;
    for (const ActionId action : applicable_) {
      if (product_.Apply(action, source_, scratch_)) edges.push_back({action, Insert(scratch_)});
    }
    edges_[ToIndex(state)] = std::move(edges);
  }
  return edges_[ToIndex(state)];
}

}  // namespace tether::task
