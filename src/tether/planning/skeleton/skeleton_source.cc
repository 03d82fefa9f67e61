#include "tether/planning/skeleton/skeleton_source.h"

#include <algorithm>
#include <utility>

#include "tether/task/search/greedy.h"

namespace tether::planning {
namespace {

// Enough to keep every thread busy, and few enough that little work is wasted on skeletons that conflicts
// exclude meanwhile.
constexpr size_t kBatch = 16;
// Skeletons that return to a state: the most that are examined, and how many actions longer than others they
// may be.
constexpr int kMostReturns = 200'000;
constexpr int kMoreActions = 3;

}  // namespace

SkeletonSource::SkeletonSource(const symbolic::Task& task, std::optional<task::TemporalGoal> goal,
                               const SearchOptions& options)
    : task_(task), goal_(std::move(goal)), options_(options) {
  for (const std::string& name : options_.not_first) {
    task::Conflict conflict;
    conflict.prefix = {task_.FindAction(name)};
    conflict.reason = "it could not be executed";
    if (conflict.prefix[0].valid()) conflicts_.push_back(std::move(conflict));
  }
  Restart();
}

std::unique_ptr<task::Product> SkeletonSource::MakeProduct() const {
  // The product holds the task by shared pointer, but does not outlive this one.
  auto product = std::make_unique<task::Product>(
      std::shared_ptr<const symbolic::Task>(&task_, [](const symbolic::Task*) {}), goal_);
  for (const task::Conflict& conflict : conflicts_) {
    if (conflict.anywhere) product->Forbid(conflict.prefix.back());
  }
  return product;
}

void SkeletonSource::Restart() {
  task::SkeletonOptions how;
  how.max_actions = options_.max_actions;
  how.skip_revisits = !returns_;
  if (returns_ && how.max_actions == 0) {
    size_t longest = 0;
    for (const std::vector<ActionId>& actions : yielded_) longest = std::max(longest, actions.size());
    how.max_actions = static_cast<int>(longest) + kMoreActions;
  }
  how.blind = options_.method == SearchMethod::kDijkstra || options_.method == SearchMethod::kBfs;
  how.unit_costs = options_.method == SearchMethod::kBfs;
  how.first_at_once = options_.cheapest_only;
  if (search_) {
    earlier_expanded_ += search_->expanded();
    earlier_generated_ += search_->generated();
  }
  search_ = std::make_unique<task::SkeletonSearch>(MakeProduct(), how);
  for (const task::Conflict& conflict : conflicts_) search_->AddConflict(conflict);
  fresh_ = true;
}

bool SkeletonSource::AllowReturns() {
  const bool useful = std::any_of(conflicts_.begin(), conflicts_.end(),
                                  [](const task::Conflict& conflict) { return !conflict.unless.empty(); });
  if (returns_ || !useful || ended_ == task::SearchStatus::kStateLimit) return false;
  returns_ = true;
  returns_left_ = kMostReturns;
  Restart();
  return true;
}

/// Whether some action moves an object that obstructed others.
bool SkeletonSource::IsWorthReturning(const std::vector<ActionId>& actions) const {
  bool moves = false;
  for (const task::Conflict& conflict : conflicts_) {
    if (conflict.RulesOut(actions)) return false;
    moves = moves || std::find_first_of(actions.begin(), actions.end(), conflict.unless.begin(),
                                        conflict.unless.end()) != actions.end();
  }
  return moves;
}

task::SearchOutcome SkeletonSource::FindGreedily(const Limits& limits) {
  const std::unique_ptr<task::Product> product = MakeProduct();
  task::GreedyResult result = task::FindGreedily(*product, {limits});
  earlier_expanded_ += result.expanded;
  earlier_generated_ += result.generated;
  return {result.status, std::move(result.skeleton)};
}

void SkeletonSource::AddConflict(const task::Conflict& conflict) {
  conflicts_.push_back(conflict);
  if (conflict.anywhere) {
    // Many sequences may have this action: the search must not go through all of them.
    Restart();
    return;
  }
  search_->AddConflict(conflict);
  fresh_ = false;
}

task::SearchOutcome SkeletonSource::Next(const Limits& limits, std::optional<double> max_cost) {
  if (options_.method == SearchMethod::kGreedy && !greedy_done_) {
    greedy_done_ = true;
    task::SearchOutcome outcome = FindGreedily(limits);
    const bool too_long = outcome.found() && options_.max_actions > 0 &&
                          outcome.skeleton->actions.size() > static_cast<size_t>(options_.max_actions);
    if (outcome.found() && !too_long) yielded_.insert(outcome.skeleton->actions);
    if (!too_long) return outcome;
  }
  const task::SearchLimits all{limits, max_cost};
  for (;;) {
    task::SearchOutcome outcome = search_->Next(all);
    if (outcome.found() && returns_) {
      if (returns_left_-- == 0) return {task::SearchStatus::kPruned, {}};
      if (!IsWorthReturning(outcome.skeleton->actions)) continue;
    }
    if (outcome.found() && !yielded_.insert(outcome.skeleton->actions).second) continue;
    if (outcome.status == task::SearchStatus::kDepthLimit && !fresh_ && !max_cost) {
      // All longer skeletons may be excluded by now: that would be a proof.
      Restart();
      continue;
    }
    return outcome;
  }
}

std::vector<std::vector<ActionId>> SkeletonSource::NextBatch(const Limits& limits) {
  // One by one where each may be the last one wanted.
  const bool first_greedy = options_.method == SearchMethod::kGreedy && !greedy_done_;
  const size_t size = options_.cheapest_only || first_greedy ? 1 : kBatch;
  std::vector<std::vector<ActionId>> batch;
  // Finding more expensive ones may take long, and the first plan does not wait for them.
  std::optional<double> max_cost;
  while (batch.size() < size) {
    task::SearchOutcome outcome = Next(limits, max_cost);
    ended_ = outcome.status;
    if (!outcome.found()) {
      if (max_cost && ended_ == task::SearchStatus::kDepthLimit) ended_ = task::SearchStatus::kFound;
      break;
    }
    max_cost = outcome.skeleton->cost;
    batch.push_back(std::move(outcome.skeleton->actions));
  }
  return batch;
}

}  // namespace tether::planning
