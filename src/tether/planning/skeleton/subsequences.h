#pragma once

#include <memory>
#include <vector>

#include "tether/task/goal/product.h"

namespace tether::planning {

/// A part of a sequence of actions, in its order, that reaches the goal by itself.
struct Subsequence {
  std::vector<int> actions;  ///< Indices into Task::actions().
  bool revisits = false;     ///< It comes back to a symbolic state.
};

/// What sequences of actions hold that reach the goal: which of their parts do so by themselves, and which
/// sequences differ only in the order of parts that don't depend on each other. Symbols only.
class Subsequences {
 public:
  /// Up to so many actions, Find() is exact: whether a plan has a part that does without the rest is
  /// NP-complete (Fink and Yang 1992).
  static constexpr size_t kExact = 12;

  /// The product is stepped by this alone.
  explicit Subsequences(std::unique_ptr<task::Product> product);

  /// The proper subsequences that are applicable from the start and reach the goal at their last action and
  /// not before, each once, short ones first. Of more than kExact actions those that action elimination
  /// (Nakhost and Müller 2010) comes by: for each action the sequence without it and without what can't be
  /// done then; and the same again and again.
  std::vector<Subsequence> Find(const std::vector<int>& actions);

  /// The same for all sequences that become one another when adjacent parts are exchanged, which can be done
  /// in either order and lead to the same state: a part that begins with an action of lower number comes
  /// first. Where such exchanges block one another there may be several, so that different forms prove
  /// nothing.
  std::vector<int> NormalOrder(std::vector<int> actions);
  /// Every sequence that one such exchange leads to.
  std::vector<std::vector<int>> Exchanged(const std::vector<int>& actions);

 private:
  using States = std::vector<symbolic::State>;

  /// The state after an action; false if it is not applicable or the goal is lost.
  bool Step(int action, const symbolic::State& state, symbolic::State& next);
  void FindFrom(size_t index);
  /// Without the action at `index` and what can't be done then; empty if that does not reach the goal.
  std::vector<int> Eliminate(const std::vector<int>& actions, size_t index);
  void Add(std::vector<int> actions);
  bool Revisits(const std::vector<int>& actions);
  /// The states that a sequence goes through, the first included; shorter if it can't be done.
  States Trace(const std::vector<int>& actions);
  /// Visits adjacent parts [i, j) and [j, k), whose first actions are wanted, that can be exchanged, with the
  /// states then after each of their actions. `visit` returns false to end.
  template <typename Want, typename Visit>
  void ForEachExchange(const std::vector<int>& actions, const States& states, Want want, Visit visit);

  std::unique_ptr<task::Product> product_;
  std::optional<symbolic::State> start_;
  // Of Find().
  const std::vector<int>* whole_ = nullptr;
  std::vector<int> part_;
  States states_;
  std::vector<Subsequence> found_;
};

}  // namespace tether::planning
