#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tether/symbolic/grounding/task.h"
#include "tether/task/goal/product.h"

namespace tether::task {

/// What else can be done when an action of a running plan can't: asks the task search again, from the state
/// that the plan has come to. The blocked action is a conflict of that state; when it is blocked for the
/// second time, it is one anywhere. Deterministic: the search ends at a number of states, not at a time.
class Replanner {
 public:
  /// A temporal `goal` takes the place of the task's own.
  Replanner(std::shared_ptr<const symbolic::Task> task, std::optional<task::TemporalGoal> goal);

  /// The cheapest actions from after `done` to the goal that don't begin with `blocked`; empty, with the
  /// reason, if none are found.
  std::optional<std::vector<std::string>> Find(const std::vector<std::string>& done,
                                               const std::string& blocked, std::string& reason);

 private:
  std::shared_ptr<const symbolic::Task> task_;
  std::optional<task::TemporalGoal> goal_;
  std::map<int, int> times_blocked_;                      ///< By action.
  std::vector<std::pair<symbolic::State, int>> blocked_;  ///< Actions, with the state of the task.
};

}  // namespace tether::task
