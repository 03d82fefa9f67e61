#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tether/symbolic/grounding/task.h"
#include "tether/task/goal/product.h"

namespace tether::task {

/// Finds other actions when an action of a running plan fails: searches the task again from the plan's
/// present state. The blocked action is a conflict in that state; when it is blocked a second time, it is one
/// anywhere. Deterministic: the search ends at a number of states, not at a time.
class Replanner {
 public:
  /// A temporal `goal` replaces the task's own.
  Replanner(std::shared_ptr<const symbolic::Task> task, std::optional<task::TemporalGoal> goal);

  /// The cheapest actions from after `done` to the goal that don't begin with `blocked`; empty, with the
  /// reason, if none are found.
  std::optional<std::vector<std::string>> Find(const std::vector<std::string>& done,
                                               const std::string& blocked, std::string& reason);

 private:
  std::shared_ptr<const symbolic::Task> task_;
  std::optional<task::TemporalGoal> goal_;
  std::map<ActionId, int> times_blocked_;
  std::vector<std::pair<symbolic::State, ActionId>> blocked_;  ///< Actions, with the state of the task.
};

}  // namespace tether::task
