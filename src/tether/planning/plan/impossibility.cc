#include "tether/planning/plan/impossibility.h"

#include <algorithm>
#include <deque>
#include <memory>
#include <set>

namespace tether::planning {
namespace {

/// What is reachable with some actions left out.
struct Reached {
  bool goal = false, all_seen = true;
  IndexedVector<ActionId, bool> done;  // it is applicable somewhere
};

Reached Explore(task::Product& product, const IndexedVector<ActionId, bool>& left_out, size_t most_states,
                const Limits& limits) {
  Reached reached;
  reached.done.assign(left_out.size(), false);
  const std::optional<symbolic::State> start = product.Start();
  if (!start) return reached;
  std::set<symbolic::State> seen{*start};
  std::deque<const symbolic::State*> open{&*seen.begin()};
  std::vector<ActionId> applicable;
  symbolic::State next(product.words());
  while (!open.empty()) {
    const symbolic::State& state = *open.front();
    open.pop_front();
    if (product.IsGoal(state)) {
      reached.goal = true;
      return reached;
    }
    product.FindApplicable(state, applicable);
    for (const ActionId action : applicable) {
      if (left_out[action]) continue;
      reached.done[action] = true;
      if (!product.Apply(action, state, next)) continue;
      const auto [place, fresh] = seen.insert(next);
      if (fresh) open.push_back(&*place);
    }
    if (seen.size() > most_states || limits.Over()) {
      reached.all_seen = false;
      return reached;
    }
  }
  return reached;
}

}  // namespace

bool NoSequenceIsLeft(const symbolic::Task& task, const std::optional<task::TemporalGoal>& goal,
                      const std::vector<task::Conflict>& conflicts, size_t most_states,
                      const Limits& limits) {
  // The product holds the task by shared pointer, but does not outlive this call.
  task::Product product(std::shared_ptr<const symbolic::Task>(&task, [](const symbolic::Task*) {}), goal);
  IndexedVector<ActionId, bool> left_out(task.actions().size(), false);
  const auto fails = [](const task::Conflict& conflict) {
    return conflict.kind == task::Conflict::Kind::kProved && (conflict.anywhere || !conflict.unless.empty());
  };
  for (const task::Conflict& conflict : conflicts) {
    if (fails(conflict)) left_out[conflict.prefix.back()] = true;
  }
  // An action that fails only as long as nothing is moved is allowed again once an action that moves it is
  // applicable.
  for (;;) {
    const Reached reached = Explore(product, left_out, most_states, limits);
    if (reached.goal || !reached.all_seen) return false;
    bool more = false;
    for (const ActionId action : left_out.ids()) {
      if (!left_out[action]) continue;
      const bool still = std::any_of(conflicts.begin(), conflicts.end(), [&](const task::Conflict& conflict) {
        return fails(conflict) && conflict.prefix.back() == action &&
               std::none_of(conflict.unless.begin(), conflict.unless.end(),
                            [&](ActionId other) { return reached.done[other]; });
      });
      if (still) continue;
      left_out[action] = false;
      more = true;
    }
    if (!more) return true;
  }
}

}  // namespace tether::planning
