#include "tether/task/search/skeleton.h"

#include <algorithm>
#include <limits>
#include <utility>

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
      return tether::Describe(Limit::kTime);
    case SearchStatus::kMemoryLimit:
      return tether::Describe(Limit::kMemory);
    case SearchStatus::kInterrupted:
      return tether::Describe(Limit::kInterrupted);
  }
  return "";
}

SearchStatus StatusOf(Limit limit) {
  switch (limit) {
    case Limit::kTime:
      return SearchStatus::kTimeLimit;
    case Limit::kMemory:
      return SearchStatus::kMemoryLimit;
    case Limit::kInterrupted:
      break;
  }
  return SearchStatus::kInterrupted;
}

SkeletonSearch::SkeletonSearch(std::shared_ptr<const symbolic::Task> task, SkeletonOptions options)
    : SkeletonSearch(std::make_unique<Product>(std::move(task)), options) {}

SkeletonSearch::SkeletonSearch(std::unique_ptr<Product> product, SkeletonOptions options)
    : product_(std::move(product)),
      options_(options),
      graph_(*product_, {.blind = options.blind,
                         .unit_costs = options.unit_costs,
                         .symmetry = options.symmetry && !options.blind,
                         .strengthen_after = options.strengthen_after}),
      may_come_at_once_(options.first_at_once) {
  options_.Validate();
  if (!options_.unit_costs) unit_ = task().cost_unit();
  bool some_are_free = false;
  for (const ActionId action : task().actions().ids()) {
    const int64_t cost = graph_.action_cost(action);
    every_action_costs_1_ = every_action_costs_1_ && cost == 1;
    some_are_free = some_are_free || cost == 0;
  }
  if (some_are_free && !options_.skip_revisits && options_.max_actions == 0) {
    throw InputError("some actions cost nothing, so there is no end of skeletons of the same cost",
                     "skip_revisits, or a limit max_actions");
  }
}

SearchStatus SkeletonSearch::NothingLeft() const {
  if (too_long_) return SearchStatus::kDepthLimit;
  return pruned_unproved_ ? SearchStatus::kPruned : SearchStatus::kExhausted;
}

std::optional<SearchStatus> SkeletonSearch::CheckLimits(const SearchLimits& limits, bool now) {
  if (!now && ++ticks_ % 16 != 0) return std::nullopt;
  const auto limit = limits.Reached();
  return limit ? std::optional(StatusOf(*limit)) : std::nullopt;
}

/// Explores far enough for skeletons of the next cost that may have some, or returns why that is not
/// possible. kFound: the first one is known already.
std::optional<SearchStatus> SkeletonSearch::Explore(const SearchLimits& limits) {
  const double most = limits.max_cost ? *limits.max_cost : std::numeric_limits<double>::infinity();
  while (true) {
    if (graph_.goal_cost() > next_level_)
      next_level_ = std::max(next_level_, std::min(graph_.bound(), graph_.goal_cost()));
    if (next_level_ == StateGraph::kFar) return NothingLeft();
    if (static_cast<double>(next_level_) * unit_ > most) return SearchStatus::kDepthLimit;
    if (every_action_costs_1_ && options_.max_actions > 0 && next_level_ > options_.max_actions)
      return SearchStatus::kDepthLimit;
    while (graph_.bound() <= next_level_ && graph_.bound() != StateGraph::kFar) {
      if (const auto stop = CheckLimits(limits, false)) return stop;
      if (graph_.states() > options_.max_states) return SearchStatus::kStateLimit;
      const int state = graph_.ExpandNext();
      if (!may_come_at_once_ || !graph_.is_goal(state)) continue;
      may_come_at_once_ = false;
      std::vector<ActionId> actions = graph_.PathTo(state);
      const bool too_long =
          options_.max_actions > 0 && actions.size() > static_cast<size_t>(options_.max_actions);
      if (too_long || IsForbidden(actions)) continue;
      first_ = std::move(actions);
      return SearchStatus::kFound;
    }
    if (graph_.goal_cost() <= next_level_) return std::nullopt;
  }
}

void SkeletonSearch::StartLevel(int64_t cost) {
  if (distances_of_ != graph_.closed() || distance_.size() != graph_.states()) {
    distance_ = graph_.GoalDistances();
    distances_of_ = graph_.closed();
  }
  may_come_at_once_ = false;
  level_ = cost;
  // Nothing is known beyond the explored part.
  next_level_ = graph_.bound();
  if (graph_.symmetry() != nullptr && !lifted_ && graph_.states() > 0)
    lifted_ = std::make_unique<LiftedStates>(*product_, graph_);
  on_path_.assign(graph_.states(), false);
  enumerating_ = true;
  const int64_t cheapest = distance_.empty() ? StateGraph::kFar : distance_[0];
  if (cheapest <= cost) {
    Push(0, 0, 0);
  } else {
    next_level_ = std::min(next_level_, cheapest);
  }
}

void SkeletonSearch::Push(int state, int rule, int64_t cost) {
  path_.push_back(
      {state,
       lifted_ ? lifted_->Edges(state)
               : std::span<const StateGraph::Edge>(graph_.begin_edges(state), graph_.end_edges(state)),
       rule, cost});
  if (on_path_.next_id() <= state) on_path_.resize(ToIndex(2 * state + 1), false);
  on_path_[state] = true;
  ++walked_;
}

void SkeletonSearch::Pop() {
  const int state = path_.back().state;
  path_.pop_back();
  if (!path_actions_.empty()) path_actions_.pop_back();
  on_path_[state] = false;
}

int SkeletonSearch::Follow(int rule, ActionId action) const {
  if (rule < 0) return -1;
  const auto it = rules_.find({rule, action});
  return it == rules_.end() ? -1 : it->second;
}

bool SkeletonSearch::IsForbidden(const std::vector<ActionId>& actions) const {
  if (!never_.empty() &&
      std::any_of(actions.begin(), actions.end(), [&](ActionId action) { return never_[action]; }))
    return true;
  int rule = 0;
  for (const ActionId action : actions) {
    rule = Follow(rule, action);
    if (rule < 0) return false;
    if (forbidden_[rule]) return true;
  }
  return false;
}

Skeleton SkeletonSearch::MakeSkeleton(std::vector<ActionId> actions, int64_t cost) const {
  return {std::move(actions), static_cast<double>(cost) * unit_};
}

SearchOutcome SkeletonSearch::Next(const SearchLimits& limits) {
  if (const auto stop = CheckLimits(limits, true)) return {*stop, {}};
  if (forbidden_[0]) return {NothingLeft(), {}};
  while (true) {
    if (!enumerating_) {
      const auto stop = Explore(limits);
      if (stop == SearchStatus::kFound) return {*stop, MakeSkeleton(*first_, graph_.goal_cost())};
      if (stop) return {*stop, {}};
      StartLevel(next_level_);
    }
    while (!path_.empty()) {
      if (const auto stop = CheckLimits(limits, false)) return {*stop, {}};
      Frame& top = path_.back();
      if (graph_.is_goal(Base(top.state))) {
        const int64_t cost = top.cost;
        const bool is_new =
            cost == level_ && path_actions_ != first_;  // Cheaper ones came with their own level.
        Skeleton skeleton = MakeSkeleton(path_actions_, cost);
        Pop();
        if (is_new) return {SearchStatus::kFound, std::move(skeleton)};
        continue;
      }
      if (top.edges.empty()) {
        Pop();
        continue;
      }
      const StateGraph::Edge edge = top.edges.front();
      top.edges = top.edges.subspan(1);
      ++tried_;
      const int64_t distance = distance_[Base(edge.target)];
      if (distance == StateGraph::kFar) continue;
      if (options_.skip_revisits && edge.target < on_path_.next_id() && on_path_[edge.target]) continue;
      const int rule = Follow(top.rule, edge.action);
      if (rule >= 0 && forbidden_[rule]) continue;
      if (!never_.empty() && never_[edge.action]) continue;
      const int64_t cost = top.cost + graph_.action_cost(edge.action);
      if (cost + distance > level_) {
        next_level_ = std::min(next_level_, cost + distance);
        continue;
      }
      if (!every_action_costs_1_ && options_.max_actions > 0 &&
          path_actions_.size() >= static_cast<size_t>(options_.max_actions)) {
        too_long_ = true;
        continue;
      }
      path_actions_.push_back(edge.action);
      Push(edge.target, rule, cost);
    }
    enumerating_ = false;
  }
}

std::optional<SearchStatus> SkeletonSearch::ExploreAll(const SearchLimits& limits) {
  while (graph_.ExpandBeyondGoals()) {
    if (const auto stop = CheckLimits(limits, false)) return stop;
    if (graph_.states() > options_.max_states) return SearchStatus::kStateLimit;
  }
  return std::nullopt;
}

void SkeletonSearch::AddConflict(const Conflict& conflict) {
  if (conflict.anywhere && !conflict.prefix.empty()) {
    never_.resize(task().actions().size(), false);
    never_[conflict.prefix.back()] = true;
    pruned_unproved_ = pruned_unproved_ || conflict.kind == Conflict::Kind::kGaveUp;
    const auto first = std::find(path_actions_.begin(), path_actions_.end(), conflict.prefix.back());
    const auto kept = static_cast<size_t>(first - path_actions_.begin());
    while (path_.size() > kept + 1) Pop();
    return;
  }
  int node = 0;
  for (const ActionId action : conflict.prefix) {
    const auto [it, is_new] = rules_.emplace(std::make_pair(node, action), forbidden_.next_id());
    if (is_new) forbidden_.push_back(false);
    node = it->second;
  }
  forbidden_[node] = true;
  pruned_unproved_ = pruned_unproved_ || conflict.kind == Conflict::Kind::kGaveUp;
  // The enumeration may stand inside what is now forbidden.
  int rule = 0;
  for (size_t i = 0; i < path_.size(); ++i) {
    if (i > 0) {
      const int follow = Follow(path_[i - 1].rule, path_actions_[i - 1]);
      path_[i].rule = follow;
      if (follow < 0) break;
      rule = follow;
    }
    if (forbidden_[rule]) {
      while (path_.size() > i) Pop();
      break;
    }
  }
}

}  // namespace tether::task
