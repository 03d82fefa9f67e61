#include "tether/task/skeleton.h"

#include <algorithm>
#include <cassert>

namespace tether::task {

void SkeletonOptions::Validate() const {
  if (max_actions < 0) {
    throw InputError("max_actions is " + std::to_string(max_actions),
                     "accepted: a positive number, or 0 for no limit");
  }
  if (max_states == 0) throw InputError("max_states is 0", "accepted: a positive number");
}

std::string_view Describe(SearchStatus status) {
  switch (status) {
    case SearchStatus::kFound:
      return "a candidate was found";
    case SearchStatus::kExhausted:
      return "every candidate was enumerated: there is no other";
    case SearchStatus::kPruned:
      return "no candidate is left, but some were ruled out without proof";
    case SearchStatus::kDepthLimit:
      return "no candidate is left within the limit on the number of actions; longer ones may exist";
    case SearchStatus::kStateLimit:
      return "the limit on the number of symbolic states was reached";
    case SearchStatus::kTimeLimit:
      return "the time limit was reached";
    case SearchStatus::kInterrupted:
      return "interrupted";
  }
  return "";
}

SkeletonSearch::SkeletonSearch(std::shared_ptr<const symbolic::Task> task, SkeletonOptions options)
    : task_(std::move(task)), options_(options), graph_(task_) {
  options_.Validate();
}

std::optional<SearchStatus> SkeletonSearch::CheckLimits(const SearchLimits& limits, bool now) {
  if (!now && ++ticks_ % 256 != 0) return std::nullopt;
  if (limits.stop.stop_requested()) return SearchStatus::kInterrupted;
  if (limits.deadline && std::chrono::steady_clock::now() >= *limits.deadline)
    return SearchStatus::kTimeLimit;
  return std::nullopt;
}

/// Explores far enough for skeletons of the next length, or says why that can't be.
std::optional<SearchStatus> SkeletonSearch::Explore(const SearchLimits& limits) {
  int most = StateGraph::kFar;
  for (const int limit : {options_.max_actions, limits.max_actions}) {
    if (limit > 0) most = std::min(most, limit);
  }
  while (true) {
    if (graph_.frontier() == 0 && !graph_.has_goal()) return NothingLeft();
    if (next_length_ == StateGraph::kFar) return NothingLeft();
    if (next_length_ > most) return SearchStatus::kDepthLimit;
    while (graph_.frontier() > 0 && graph_.frontier_depth() < next_length_) {
      if (const auto stop = CheckLimits(limits, false)) return stop;
      if (graph_.states() > options_.max_states) return SearchStatus::kStateLimit;
      graph_.ExpandNext();
    }
    if (graph_.has_goal()) return std::nullopt;
    if (graph_.frontier() > 0) ++next_length_;
  }
}

void SkeletonSearch::StartLength(int length) {
  if (distances_of_ != graph_.expanded() || distance_.empty()) {
    distance_ = graph_.GoalDistances();
    distances_of_ = graph_.expanded();
  }
  length_ = length;
  // Beyond the explored part anything may lie.
  next_length_ = graph_.frontier() > 0 ? length + 1 : StateGraph::kFar;
  on_path_.assign(graph_.states(), false);
  enumerating_ = true;
  const int shortest = distance_[0];
  if (shortest <= length) {
    Push(0, 0);
  } else {
    next_length_ = std::min(next_length_, shortest);
  }
}

void SkeletonSearch::Push(int state, int rule) {
  path_.push_back({state, graph_.begin_edges(state), rule});
  on_path_[static_cast<size_t>(state)] = true;
  ++walked_;
}

void SkeletonSearch::Pop() {
  const int state = path_.back().state;
  path_.pop_back();
  if (!path_actions_.empty()) path_actions_.pop_back();
  on_path_[static_cast<size_t>(state)] = false;
}

int SkeletonSearch::Follow(int rule, int action) const {
  if (rule < 0) return -1;
  const auto it = rules_.find({rule, action});
  return it == rules_.end() ? -1 : it->second;
}

SearchOutcome SkeletonSearch::Next(const SearchLimits& limits) {
  if (const auto stop = CheckLimits(limits, true)) return {*stop, {}};
  if (forbidden_[0]) return {NothingLeft(), {}};
  while (true) {
    if (!enumerating_) {
      if (const auto stop = Explore(limits)) return {*stop, {}};
      StartLength(next_length_);
    }
    while (!path_.empty()) {
      if (const auto stop = CheckLimits(limits, false)) return {*stop, {}};
      Frame& top = path_.back();
      const int depth = static_cast<int>(path_actions_.size());
      if (graph_.is_goal(top.state)) {
        Skeleton skeleton{path_actions_, static_cast<double>(depth)};
        const bool is_new = depth == length_;  // Shorter ones came with their own length.
        Pop();
        if (is_new) return {SearchStatus::kFound, std::move(skeleton)};
        continue;
      }
      if (top.next == graph_.end_edges(top.state)) {
        Pop();
        continue;
      }
      const StateGraph::Edge edge = *top.next++;
      ++tried_;
      const int distance = distance_[static_cast<size_t>(edge.target)];
      if (distance == StateGraph::kFar) continue;
      if (options_.skip_revisits && on_path_[static_cast<size_t>(edge.target)]) continue;
      const int rule = Follow(top.rule, edge.action);
      if (rule >= 0 && forbidden_[static_cast<size_t>(rule)]) continue;
      if (depth + 1 + distance > length_) {
        next_length_ = std::min(next_length_, depth + 1 + distance);
        continue;
      }
      path_actions_.push_back(edge.action);
      Push(edge.target, rule);
    }
    enumerating_ = false;
  }
}

void SkeletonSearch::AddConflict(const Conflict& conflict) {
  int node = 0;
  for (int action : conflict.prefix) {
    const auto [it, is_new] =
        rules_.emplace(std::make_pair(node, action), static_cast<int>(forbidden_.size()));
    if (is_new) forbidden_.push_back(false);
    node = it->second;
  }
  forbidden_[static_cast<size_t>(node)] = true;
  pruned_unproved_ = pruned_unproved_ || conflict.kind == Conflict::Kind::kGaveUp;
  // The enumeration may stand inside what is now forbidden.
  for (size_t i = 0, rule = 0; i < path_.size(); ++i) {
    if (i > 0) {
      const int follow = Follow(path_[i - 1].rule, path_actions_[i - 1]);
      path_[i].rule = follow;
      if (follow < 0) break;
      rule = static_cast<size_t>(follow);
    }
    if (forbidden_[rule]) {
      while (path_.size() > i) Pop();
      break;
    }
  }
}

}  // namespace tether::task
