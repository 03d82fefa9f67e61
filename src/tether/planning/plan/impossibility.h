#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "tether/planning/plan/limits.h"
#include "tether/task/goal/conflict.h"
#include "tether/task/goal/product.h"

namespace tether::planning {

/// Whether no sequence of actions, however long, reaches the goal of `task` (or the temporal `goal` in its
/// place) without the actions that `conflicts` prove to fail: those that fail anywhere, and those that fail
/// unless certain others come before, as long as none of these is applicable. Examines up to `most_states`
/// states of the product; false where there are more, or a limit is reached.
bool NoSequenceIsLeft(const symbolic::Task& task, const std::optional<task::TemporalGoal>& goal,
                      const std::vector<task::Conflict>& conflicts, size_t most_states, const Limits& limits);

}  // namespace tether::planning
