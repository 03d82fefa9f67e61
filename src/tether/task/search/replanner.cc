#include "tether/task/search/replanner.h"

#include <utility>

#include "tether/task/search/skeleton.h"

namespace tether::task {
namespace {

constexpr size_t kMaxStates = 300'000;

}  // namespace

Replanner::Replanner(std::shared_ptr<const symbolic::Task> task, std::optional<task::TemporalGoal> goal)
    : task_(std::move(task)), goal_(std::move(goal)) {}

std::optional<std::vector<std::string>> Replanner::Find(const std::vector<std::string>& done,
                                                        const std::string& blocked, std::string& reason) {
  std::vector<ActionId> actions;
  for (const std::string& name : done) {
    actions.push_back(task_->FindAction(name));
    if (!actions.back().valid()) {
      reason = "the task has no action '" + name + "'";
      return std::nullopt;
    }
  }
  const ActionId failed = task_->FindAction(blocked);
  auto product = std::make_unique<task::Product>(task_, goal_);
  product->BeginAfter(std::move(actions));
  const auto start = product->Start();
  if (!failed.valid() || !start) {
    reason = !failed.valid() ? "the task has no action '" + blocked + "'" : "the goal is lost already";
    return std::nullopt;
  }
  ++times_blocked_[failed];
  blocked_.emplace_back(*start, failed);
  for (const auto& [action, times] : times_blocked_) {
    if (times > 1) product->Forbid(action);
  }
  task::SkeletonOptions options;
  options.max_states = kMaxStates;
  options.first_at_once = true;
  options.symmetry = false;  // an action blocked for one object need not be for another
  task::SkeletonSearch search(std::move(product), options);
  for (const auto& [state, action] : blocked_) {
    if (state != *start) continue;
    task::Conflict conflict;
    conflict.prefix = {action};
    conflict.reason = "it could not be executed";
    search.AddConflict(conflict);
  }
  const task::SearchOutcome outcome = search.Next();
  if (!outcome.found()) {
    const bool limit = outcome.status == task::SearchStatus::kStateLimit;
    reason = limit ? "no other actions were found within " + std::to_string(kMaxStates) + " states"
                   : "no other actions lead to the goal without " + blocked;
    return std::nullopt;
  }
  std::vector<std::string> names;
  for (const ActionId action : outcome.skeleton->actions) names.push_back(task_->actions()[action].name);
  return names;
}

}  // namespace tether::task
