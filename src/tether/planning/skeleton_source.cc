#include "tether/planning/skeleton_source.h"

#include <utility>

namespace tether::planning {
namespace {

// Enough to keep every thread busy, and few enough that what is refuted meanwhile costs little.
constexpr size_t kBatch = 16;
// Where the best of all are wanted, all are compared, but not more than this at a time.
constexpr size_t kLargestBatch = 1000;

}  // namespace

SkeletonSource::SkeletonSource(const symbolic::Task& task, const SearchOptions& options)
    : task_(task), options_(options) {
  Restart();
}

void SkeletonSource::Restart() {
  // The search holds the task by shared pointer, but does not outlive this one.
  search_ = std::make_unique<task::SkeletonSearch>(
      std::shared_ptr<const symbolic::Task>(&task_, [](const symbolic::Task*) {}),
      task::SkeletonOptions{options_.max_actions});
  for (const task::Conflict& conflict : conflicts_) search_->AddConflict(conflict);
  fresh_ = true;
}

void SkeletonSource::AddConflict(const task::Conflict& conflict) {
  search_->AddConflict(conflict);
  conflicts_.push_back(conflict);
  fresh_ = false;
}

task::SearchOutcome SkeletonSource::Next(const Limits& limits, std::optional<double> max_cost) {
  // In short turns, so that an interruption is noticed.
  for (;;) {
    task::SearchLimits turn;
    turn.deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(100);
    turn.max_cost = max_cost;
    task::SearchOutcome outcome = search_->Next(turn);
    if (outcome.found() && !yielded_.insert(outcome.skeleton->actions).second) continue;
    if (outcome.status == task::SearchStatus::kDepthLimit && !fresh_) {
      // What the search knew of longer skeletons may be ruled out by now: that would be a proof.
      Restart();
      continue;
    }
    if (outcome.status != task::SearchStatus::kTimeLimit) return outcome;
    if (limits.Stopped()) return {task::SearchStatus::kInterrupted, {}};
    if (limits.Over()) return outcome;
  }
}

std::vector<std::vector<int>> SkeletonSource::NextBatch(const Limits& limits) {
  const size_t size = options_.max_plans > 0 ? kLargestBatch : kBatch;
  std::vector<std::vector<int>> batch;
  // Without a limit on their length there is no end of candidates: then the cheapest are compared first.
  std::optional<double> max_cost;
  while (batch.size() < size) {
    task::SearchOutcome outcome = Next(limits, max_cost);
    ended_ = outcome.status;
    if (!outcome.found()) {
      if (max_cost && ended_ == task::SearchStatus::kDepthLimit) ended_ = task::SearchStatus::kFound;
      break;
    }
    if (options_.max_plans > 0 && options_.max_actions == 0) max_cost = outcome.skeleton->cost;
    batch.push_back(std::move(outcome.skeleton->actions));
  }
  return batch;
}

}  // namespace tether::planning
