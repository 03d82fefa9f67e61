#pragma once

#include <memory>
#include <vector>

#include "tether/common/id.h"
#include "tether/task/goal/product.h"

namespace tether::planning {

/// A part of a sequence of actions, in its order, that reaches the goal by itself.
struct Subsequence {
  std::vector<ActionId> actions;
  bool revisits = false;  ///< It comes back to a symbolic state.
};

/// Compares action sequences that reach the goal, by symbols only: which of their subsequences reach it by
/// themselves, and which sequences differ only in the order of independent parts.
class Subsequences {
 public:
  /// Up to this many actions, Find() is exact: whether a plan has a proper subsequence that is a plan is
  /// NP-complete (Fink and Yang 1992).
  static constexpr size_t kExact = 12;

  /// The product is stepped by this alone.
  explicit Subsequences(std::unique_ptr<task::Product> product);

  /// The proper subsequences that are applicable from the start and reach the goal at their last action and
  /// not before, each once, short ones first. Of more than kExact actions, those that action elimination
  /// finds (Nakhost and Müller 2010): for each action the sequence without it and without the actions that
  /// are then not applicable; and the same repeatedly.
  std::vector<Subsequence> Find(const std::vector<ActionId>& actions);

  /// A normal form under exchanges of adjacent parts that are applicable in either order and lead to the same
  /// state: the part that begins with the action of lower number comes first. Where such exchanges block one
  /// another there may be several normal forms, so that different forms prove nothing.
  std::vector<ActionId> NormalOrder(std::vector<ActionId> actions);
  /// Every sequence that one such exchange leads to.
  std::vector<std::vector<ActionId>> Exchanged(const std::vector<ActionId>& actions);

 private:
  using States = std::vector<symbolic::State>;

  /// The state after an action; false if it is not applicable or the goal is lost.
  bool Step(ActionId action, const symbolic::State& state, symbolic::State& next);
  void FindFrom(size_t index);
  /// Without the action at `index` and those that are then not applicable; empty if that does not reach the
  /// goal.
  std::vector<ActionId> Eliminate(const std::vector<ActionId>& actions, size_t index);
  void Add(std::vector<ActionId> actions);
  bool Revisits(const std::vector<ActionId>& actions);
  /// The states of a sequence, the first included; shorter if it is not applicable.
  States Trace(const std::vector<ActionId>& actions);
  /// Visits adjacent parts [i, j) and [j, k), whose first actions are wanted, that can be exchanged, with the
  /// states then after each of their actions. `visit` returns false to end.
  template <typename Want, typename Visit>
  void ForEachExchange(const std::vector<ActionId>& actions, const States& states, Want want, Visit visit);

  std::unique_ptr<task::Product> product_;
  std::optional<symbolic::State> start_;
  // Of Find().
  const std::vector<ActionId>* whole_ = nullptr;
  std::vector<ActionId> part_;
  States states_;
  std::vector<Subsequence> found_;
};

}  // namespace tether::planning
