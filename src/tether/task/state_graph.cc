#include "tether/task/state_graph.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace tether::task {
namespace {

uint64_t Hash(symbolic::StateView state) {
  uint64_t hash = 0x9E3779B97F4A7C15u;
  for (uint64_t word : state) {
    hash ^= word;
    hash *= 0xBF58476D1CE4E5B9u;
    hash ^= hash >> 29;
    hash *= 0x94D049BB133111EBu;
    hash ^= hash >> 32;
  }
  return hash;
}

}  // namespace

StateGraph::StateGraph(std::shared_ptr<const symbolic::Task> task)
    : task_(std::move(task)), width_(task_->words()), slots_(64, -1), scratch_(width_) {
  Insert(task_->initial_state(), 0);
}

int StateGraph::Insert(symbolic::StateView state, int depth) {
  const size_t mask = slots_.size() - 1;
  size_t slot = Hash(state) & mask;
  for (; slots_[slot] >= 0; slot = (slot + 1) & mask) {
    const symbolic::StateView known = this->state(slots_[slot]);
    if (std::equal(known.begin(), known.end(), state.begin())) return slots_[slot];
  }
  const int index = static_cast<int>(depth_.size());
  slots_[slot] = index;
  words_.insert(words_.end(), state.begin(), state.end());
  depth_.push_back(depth);
  goal_.push_back(task_->IsGoal(state));
  has_goal_ = has_goal_ || goal_.back();
  if (depth_.size() * 2 > slots_.size()) Grow();
  return index;
}

void StateGraph::Grow() {
  slots_.assign(slots_.size() * 2, -1);
  const size_t mask = slots_.size() - 1;
  for (size_t i = 0; i < depth_.size(); ++i) {
    size_t slot = Hash(state(static_cast<int>(i))) & mask;
    while (slots_[slot] >= 0) slot = (slot + 1) & mask;
    slots_[slot] = static_cast<int>(i);
  }
}

void StateGraph::ExpandNext() {
  assert(frontier() > 0);
  const int source = static_cast<int>(expanded_++);
  first_edge_.push_back(edges_.size());
  if (is_goal(source)) return;
  for (size_t i = 0; i < task_->actions().size(); ++i) {
    const int action = static_cast<int>(i);
    if (!task_->IsApplicable(action, state(source))) continue;
    task_->Apply(action, state(source), scratch_);
    edges_.push_back({action, Insert(scratch_, depth(source) + 1)});
  }
}

std::vector<int> StateGraph::GoalDistances() const {
  std::vector<size_t> first(states() + 1, 0);
  for (const Edge& edge : edges_) ++first[static_cast<size_t>(edge.target) + 1];
  for (size_t i = 0; i < states(); ++i) first[i + 1] += first[i];
  std::vector<int> sources(edges_.size());
  std::vector<size_t> fill(first.begin(), first.end() - 1);
  for (size_t s = 0; s < expanded_; ++s) {
    const int source = static_cast<int>(s);
    for (const Edge* e = begin_edges(source); e != end_edges(source); ++e) {
      sources[fill[static_cast<size_t>(e->target)]++] = source;
    }
  }
  std::vector<int> distance(states(), kFar);
  std::vector<int> queue;
  for (size_t s = 0; s < states(); ++s) {
    if (!goal_[s]) continue;
    distance[s] = 0;
    queue.push_back(static_cast<int>(s));
  }
  for (size_t i = 0; i < queue.size(); ++i) {
    const auto target = static_cast<size_t>(queue[i]);
    for (size_t k = first[target]; k < first[target + 1]; ++k) {
      int& d = distance[static_cast<size_t>(sources[k])];
      if (d != kFar) continue;
      d = distance[target] + 1;
      queue.push_back(sources[k]);
    }
  }
  return distance;
}

}  // namespace tether::task
