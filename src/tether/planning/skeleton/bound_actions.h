#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tether/common/error.h"
#include "tether/common/id.h"
#include "tether/constraints/core/memo.h"
#include "tether/planning/skeleton/skeleton_binding.h"
#include "tether/symbolic/grounding/task.h"

namespace tether::planning {

/// "pick(hook)", …
std::vector<std::string> ActionNames(const symbolic::Task& task, const std::vector<ActionId>& actions);

/// The ground actions of a task with their names bound, each once, when it is first asked for. Thread-safe.
class BoundActions {
 public:
  /// Both must outlive this.
  BoundActions(const Problem& problem, std::shared_ptr<const scene::Frames> frames,
               const symbolic::Task& task)
      : task_(task),
        frames_(frames),
        binder_(problem.scene, std::move(frames), problem.actions, problem.constraints) {}

  /// Throws InputError as SkeletonBinder::Bind().
  std::shared_ptr<const Skeleton> Bind(const std::vector<ActionId>& actions) const;

 private:
  struct BoundAction {
    std::vector<BoundStep> steps;
    Diagnostics diagnostics;
  };

  const symbolic::Task& task_;
  const std::shared_ptr<const scene::Frames> frames_;
  const SkeletonBinder binder_;
  constraints::Memo<ActionId, BoundAction> bound_;
};

}  // namespace tether::planning
