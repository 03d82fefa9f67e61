#include "tether/planning/skeleton/bound_actions.h"

namespace tether::planning {

std::vector<std::string> ActionNames(const symbolic::Task& task, const std::vector<ActionId>& actions) {
  std::vector<std::string> names;
  for (const ActionId action : actions) names.push_back(task.actions()[action].name);
  return names;
}

std::shared_ptr<const Skeleton> BoundActions::Bind(const std::vector<ActionId>& actions) const {
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->frames = frames_;
  skeleton->actions = ActionNames(task_, actions);
  for (size_t i = 0; i < actions.size(); ++i) {
    const auto bound = bound_.Get(actions[i], [&] {
      BoundAction made;
      made.steps = binder_.BindAction(skeleton->actions[i], made.diagnostics);
      return made;
    });
    // Throws, with what is wrong with each of the actions.
    if (!bound->diagnostics.empty()) binder_.Bind(skeleton->actions);
    for (const BoundStep& step : bound->steps) {
      skeleton->steps.push_back(step);
      skeleton->steps.back().action_index = static_cast<int>(i);
    }
  }
  return skeleton;
}

}  // namespace tether::planning
