#include "tether/task/search/state_graph.h"

#include <algorithm>
#include <cassert>
#include <functional>
#include <utility>

#include "tether/common/limits.h"

namespace tether::task {
namespace {

/// 256 MB; when they are full, later states are estimated from the beginning.
constexpr size_t kMostLandmarks = size_t{1} << 26;

/// The number of sample states for which the estimates are strengthened.
constexpr size_t kSamples = 16;
constexpr size_t kMostEvaluations = 5000;
/// Factor on the number of expansions after which that is tried again.
constexpr uint64_t kStrengthenAgain = 16;

}  // namespace

bool StateGraph::Worse::operator()(const Entry& a, const Entry& b) const {
  if (a.bound != b.bound) return a.bound > b.bound;
  if (a.estimate != b.estimate) return a.estimate > b.estimate;
  return a.number > b.number;
}

StateGraph::StateGraph(Product& product, const Options& options)
    : product_(product),
      options_(options),
      estimate_(product, options.blind, options.unit_costs),
      table_(product.words()),
      strengthen_at_(options.strengthen_after),
      scratch_(product.words()) {
  for (const symbolic::GroundAction& action : product.task().actions()) {
    costs_.push_back(options.unit_costs ? 1 : action.cost);
  }
  if (options.symmetry) {
    symmetry_ = std::make_unique<Symmetry>(product);
    if (symmetry_->trivial()) symmetry_.reset();
  }
  if (auto start = product.Start()) Reach(*start, 0, -1, {});
}

int64_t StateGraph::EstimateCost(symbolic::StateView state, Node& node, int parent, ActionId action,
                                 bool exchanged) {
  std::span<const int> before;
  if (parent >= 0 && nodes_[parent].generation == estimate_.generation() &&
      (!exchanged || (symmetry_->maps_actions() && estimate_.landmarks_are_actions()))) {
    const Node& known = nodes_[parent];
    before = {landmarks_.data() + known.first_landmark, ToIndex(known.landmark_count)};
    // They are about objects that are exchanged now.
    if (exchanged) {
      mapped_.assign(before.begin(), before.end());
      for (size_t i = 0; i < mapped_.size();) {
        const auto end = i + 2 + ToIndex(mapped_[i + 1]);
        for (i += 2; i < end; ++i) mapped_[i] = symmetry_->Image(ActionId(mapped_[i])).value();
      }
      before = mapped_;
      action = symmetry_->Image(action);
    }
  }
  const int64_t estimate = estimate_.Evaluate(state, before, action);
  const std::span<const int> landmarks = estimate_.landmarks();
  node.generation = estimate_.generation();
  node.landmark_count = 0;
  if (estimate != Estimate::kDeadEnd && landmarks_.size() + landmarks.size() <= kMostLandmarks) {
    node.first_landmark = landmarks_.size();
    node.landmark_count = static_cast<int>(landmarks.size());
    landmarks_.insert(landmarks_.end(), landmarks.begin(), landmarks.end());
  }
  return estimate;
}

void StateGraph::Reach(std::span<uint64_t> state, int64_t cost, int parent, ActionId action) {
  bool is_new = false;
  const bool exchanged = symmetry_ && symmetry_->Canonicalize(state);
  const int index = table_.Insert(state, is_new);
  if (is_new) {
    Node& fresh = nodes_.emplace_back();
    fresh.is_goal = product_.IsGoal(state);
    fresh.estimate = fresh.is_goal ? 0 : EstimateCost(state, fresh, parent, action, exchanged);
  }
  Node& node = nodes_[index];
  if (cost >= node.cost) return;
  node.cost = cost;
  node.parent = parent;
  node.action = action;
  node.is_closed = false;
  if (node.estimate == Estimate::kDeadEnd) return;
  Push(index, NextNumber());
}

int64_t StateGraph::bound() {
  while (!open_.empty()) {
    const Entry top = open_.front();
    Node& node = nodes_[top.state];
    const bool is_current = !node.is_closed && node.cost == top.cost && node.estimate == top.estimate;
    if (is_current && (node.is_goal || node.generation == estimate_.generation())) return top.bound;
    std::pop_heap(open_.begin(), open_.end(), Worse());
    open_.pop_back();
    if (!is_current) continue;
    // Estimated before the estimates were strengthened.
    const int64_t before = node.estimate;
    node.estimate = std::max(before, EstimateCost(table_[top.state], node, -1, {}, false));
    if (node.estimate != Estimate::kDeadEnd)
      Push(top.state, node.estimate == before ? top.number : NextNumber());
  }
  return kFar;
}

uint64_t StateGraph::NextNumber() {
  // Ties go to the latest state, which continues the search where it just was; not in a blind search.
  const uint64_t number = options_.blind ? pushed_ : ~pushed_;
  ++pushed_;
  return number;
}

void StateGraph::Push(int state, uint64_t number) {
  const Node& node = nodes_[state];
  open_.push_back({node.cost + node.estimate, node.estimate, number, state, node.cost});
  std::push_heap(open_.begin(), open_.end(), Worse());
}

/// Samples the states that come next.
void StateGraph::Strengthen() {
  std::vector<symbolic::State> samples;
  const size_t some = std::min(open_.size(), 64 * kSamples);
  for (size_t i = 0; i < kSamples && i < some; ++i) {
    const symbolic::StateView view = table_[open_[i * some / kSamples].state];
    samples.emplace_back(view.begin(), view.end());
  }
  std::vector<symbolic::AtomPermutation> exchanges;
  if (symmetry_) exchanges = symmetry_->Exchanges();
  estimate_.Strengthen(samples, exchanges, std::min(nodes_.size(), kMostEvaluations));
  strengthen_at_ *= kStrengthenAgain;
}

int StateGraph::ExpandNext() {
  [[maybe_unused]] const int64_t least = bound();
  assert(least != kFar);
  const int state = open_.front().state;
  std::pop_heap(open_.begin(), open_.end(), Worse());
  open_.pop_back();
  Node& node = nodes_[state];
  ++closed_;
  node.is_closed = true;
  if (node.is_goal) {
    goal_cost_ = std::min(goal_cost_, node.cost);
  } else {
    Expand(state);
  }
  return state;
}

void StateGraph::Expand(int state) {
  if (++expanded_ == strengthen_at_ && !options_.blind) Strengthen();
  nodes_[state].is_expanded = true;
  const int64_t cost = nodes_[state].cost;
  const symbolic::StateView view = table_[state];
  source_.assign(view.begin(), view.end());
  product_.FindApplicable(source_, applicable_);
  for (const ActionId action : applicable_) {
    ++generated_;
    if (product_.Apply(action, source_, scratch_)) Reach(scratch_, cost + action_cost(action), state, action);
  }
}

bool StateGraph::ExpandBeyondGoals() {
  while (beyond_ < nodes_.next_id() && nodes_[beyond_].is_expanded) ++beyond_;
  if (beyond_ == nodes_.next_id()) return false;
  nodes_[beyond_].is_expanded = true;
  const symbolic::StateView view = table_[beyond_];
  source_.assign(view.begin(), view.end());
  product_.FindApplicable(source_, applicable_);
  for (const ActionId action : applicable_) {
    bool is_new = false;
    if (!product_.Apply(action, source_, scratch_)) continue;
    if (symmetry_) symmetry_->Canonicalize(scratch_);
    table_.Insert(scratch_, is_new);
    if (is_new) nodes_.emplace_back();
  }
  return true;
}

std::vector<ActionId> StateGraph::PathTo(int state) {
  std::vector<ActionId> actions;
  std::vector<int> states;
  for (int at = state; nodes_[at].parent >= 0; at = nodes_[at].parent) {
    actions.push_back(nodes_[at].action);
    states.push_back(at);
  }
  std::reverse(actions.begin(), actions.end());
  if (!symmetry_) return actions;
  // From the start itself: each step of the path has an image that leads to a state with the next
  // representative.
  std::reverse(states.begin(), states.end());
  symbolic::State now = *product_.Start(), next(now.size());
  for (size_t i = 0; i < actions.size(); ++i) {
    product_.FindApplicable(now, applicable_);
    [[maybe_unused]] bool found = false;
    for (const ActionId action : applicable_) {
      if (action_cost(action) != action_cost(actions[i]) || !product_.Apply(action, now, next)) continue;
      scratch_ = next;
      if (Find(scratch_) != states[i]) continue;
      actions[i] = action;
      found = true;
      break;
    }
    assert(found);
    std::swap(now, next);
  }
  return actions;
}

void StateGraph::FindEdges() {
  first_edge_.resize(states(), 0);
  end_edge_.resize(states(), 0);
  for (const int s : nodes_.ids()) {
    PollLimits();  // Here nothing is half done.
    Node& node = nodes_[s];
    if (!node.is_closed || node.is_goal || node.has_edges) continue;
    node.has_edges = true;
    first_edge_[s] = edges_.size();
    const symbolic::StateView source = table_[s];
    product_.FindApplicable(source, applicable_);
    for (const ActionId action : applicable_) {
      if (!product_.Apply(action, source, scratch_)) continue;
      edges_.push_back({action, Find(scratch_)});
    }
    end_edge_[s] = edges_.size();
  }
}

IndexedVector<int, int64_t> StateGraph::GoalDistances() {
  FindEdges();
  IndexedVector<int, size_t> first(states() + 1, 0);
  for (const Edge& edge : edges_) ++first[edge.target + 1];
  for (const int s : nodes_.ids()) first[s + 1] += first[s];
  std::vector<Edge> sources(edges_.size());  // Backwards: `target` is where the action begins.
  IndexedVector<int, size_t> fill = first;
  for (const int source : nodes_.ids()) {
    for (const Edge* e = begin_edges(source); e != end_edges(source); ++e) {
      sources[fill[e->target]++] = {e->action, source};
    }
  }
  IndexedVector<int, int64_t> distance(states(), kFar);
  std::vector<std::pair<int64_t, int>> heap;
  for (const int s : nodes_.ids()) {
    if (!nodes_[s].is_goal || !nodes_[s].is_closed) continue;
    distance[s] = 0;
    heap.emplace_back(0, s);
  }
  while (!heap.empty()) {
    PollLimits();
    std::pop_heap(heap.begin(), heap.end(), std::greater<>());
    const auto [cost, state] = heap.back();
    heap.pop_back();
    if (cost != distance[state]) continue;
    for (size_t k = first[state]; k < first[state + 1]; ++k) {
      int64_t& known = distance[sources[k].target];
      const int64_t through = cost + action_cost(sources[k].action);
      if (through >= known) continue;
      known = through;
      heap.emplace_back(through, sources[k].target);
      std::push_heap(heap.begin(), heap.end(), std::greater<>());
    }
  }
  return distance;
}

}  // namespace tether::task
