#pragma once

#include <memory>
#include <vector>

#include "tether/symbolic/grounding/task.h"

namespace tether::symbolic {

/// A task without what does not matter for its goal: the whole one itself if all of it does.
struct RelevantTask {
  std::shared_ptr<const Task> task;
  std::vector<int> actions;  ///< By action of `task`: its index in the whole one.
};

/// Leaves out the actions that bring about nothing that the goal asks for, be it through other actions'
/// conditions, and the atoms that nothing asks for. If the whole task has a plan, then so has this one, of
/// actions that cost no more (an action that is left out can be left out of any plan), and its plans are
/// plans of the whole task. Other plans are lost: for one plan only. A condition asks for its literals; what
/// adds or deletes against what is asked for, for its own condition to fail.
RelevantTask KeepRelevant(const std::shared_ptr<const Task>& whole);

}  // namespace tether::symbolic
