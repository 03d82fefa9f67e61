#pragma once

#include <memory>
#include <vector>

#include "tether/common/id.h"
#include "tether/symbolic/grounding/task.h"

namespace tether::symbolic {

/// A task without what is irrelevant to its goal: the whole one itself if all of it is relevant.
struct RelevantTask {
  std::shared_ptr<const Task> task;
  IndexedVector<ActionId, ActionId> actions;  ///< Of `task`: which one of the whole it is.
};

/// Leaves out the actions that contribute nothing to the goal, directly or through other actions' conditions,
/// and the irrelevant atoms. If the whole task has a plan, then so has this one, of no higher cost (an action
/// that is left out can be left out of any plan), and its plans are plans of the whole task. Other plans are
/// lost: use it to find one plan only. A relevant condition makes its literals relevant; an effect against a
/// relevant literal makes the negation of its own condition relevant.
RelevantTask KeepRelevant(const std::shared_ptr<const Task>& whole);

}  // namespace tether::symbolic
