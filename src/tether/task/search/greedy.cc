#include "tether/task/search/greedy.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "tether/task/heuristics/relaxed_plan.h"
#include "tether/task/search/state_table.h"

namespace tether::task {
namespace {

/// Priority that the list of preferred actions gains at each progress.
constexpr int64_t kBoost = 1000;

class Greedy {
 public:
  Greedy(Product& product, size_t max_states)
      : product_(product),
        max_states_(max_states),
        relaxation_(product),
        heuristic_(relaxation_),
        table_(product.words()),
        scratch_(product.words()) {}

  GreedyResult Run(const SearchLimits& limits) {
    const auto start = product_.Start();
    if (!start) return std::move(result_);
    if (Visit(*start, -1, {})) return std::move(result_);
    while (const auto step = Pop()) {
      if (const auto limit = limits.Reached()) return Stop(StatusOf(*limit));
      if (table_.size() > max_states_) return Stop(SearchStatus::kStateLimit);
      ++result_.generated;
      const symbolic::StateView before = table_[step->parent];
      if (!product_.Apply(step->action, before, scratch_)) continue;
      if (Visit(scratch_, step->parent, step->action)) return std::move(result_);
    }
    return std::move(result_);
  }

 private:
  struct Node {
    int parent;
    ActionId action;
  };
  struct Step {
    int64_t estimate;
    uint64_t number;  ///< Earlier ones first among equals.
    int parent;
    ActionId action;
  };
  struct Worse {
    bool operator()(const Step& a, const Step& b) const {
      return a.estimate != b.estimate ? a.estimate > b.estimate : a.number > b.number;
    }
  };
  struct List {
    std::vector<Step> heap;
    int64_t priority = 0;  ///< The list with the least is next.
  };

  GreedyResult Stop(SearchStatus status) {
    result_.status = status;
    return std::move(result_);
  }

  std::optional<Step> Pop() {
    List* next = nullptr;
    for (List& list : lists_) {
      if (!list.heap.empty() && (next == nullptr || list.priority < next->priority)) next = &list;
    }
    if (next == nullptr) return std::nullopt;
    ++next->priority;
    std::pop_heap(next->heap.begin(), next->heap.end(), Worse());
    const Step step = next->heap.back();
    next->heap.pop_back();
    return step;
  }

  void Push(List& list, int64_t estimate, int parent, ActionId action) {
    list.heap.push_back({estimate, pushed_++, parent, action});
    std::push_heap(list.heap.begin(), list.heap.end(), Worse());
  }

  /// Expands a state if it is new; true if it is a goal state.
  bool Visit(const symbolic::State& state, int parent, ActionId action) {
    bool is_new = false;
    const int index = table_.Insert(state, is_new);
    if (!is_new) return false;
    nodes_.push_back({parent, action});
    if (product_.IsGoal(state)) {
      Finish(index);
      return true;
    }
    relaxation_.FindFacts(state, facts_);
    const int64_t estimate = heuristic_.Evaluate(facts_);
    if (estimate == RelaxedPlan::kDeadEnd) return false;
    if (estimate < best_) {
      if (index > 0) lists_[0].priority -= kBoost;
      best_ = estimate;
    }
    ++result_.expanded;
    product_.FindApplicable(state, applicable_);
    const std::vector<ActionId>& preferred = heuristic_.actions();
    for (const ActionId next : applicable_) {
      if (std::binary_search(preferred.begin(), preferred.end(), next))
        Push(lists_[0], estimate, index, next);
      Push(lists_[1], estimate, index, next);
    }
    return false;
  }

  void Finish(int goal) {
    Skeleton skeleton;
    int64_t cost = 0;
    for (int at = goal; nodes_[at].parent >= 0; at = nodes_[at].parent) {
      skeleton.actions.push_back(nodes_[at].action);
      cost += product_.task().actions()[skeleton.actions.back()].cost;
    }
    std::reverse(skeleton.actions.begin(), skeleton.actions.end());
    skeleton.cost = static_cast<double>(cost) * product_.task().cost_unit();
    result_.status = SearchStatus::kFound;
    result_.skeleton = std::move(skeleton);
  }

  Product& product_;
  size_t max_states_;
  Relaxation relaxation_;
  RelaxedPlan heuristic_;
  StateTable table_;
  IndexedVector<int, Node> nodes_;
  std::array<List, 2> lists_;  ///< Preferred actions; all.
  uint64_t pushed_ = 0;
  int64_t best_ = RelaxedPlan::kDeadEnd;
  GreedyResult result_;
  symbolic::State scratch_;
  std::vector<ActionId> applicable_;
  std::vector<int> facts_;
};

}  // namespace

GreedyResult FindGreedily(Product& product, const SearchLimits& limits, size_t max_states) {
  return Greedy(product, max_states).Run(limits);
}

}  // namespace tether::task
