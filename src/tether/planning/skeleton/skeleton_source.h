#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tether/common/id.h"
#include "tether/planning/plan/limits.h"
#include "tether/planning/plan/problem.h"
#include "tether/task/search/skeleton.h"

namespace tether::planning {

/// Yields the task search's skeletons in batches, whose sizes don't depend on the number of threads.
class SkeletonSource {
 public:
  /// `task` must outlive the source. A temporal `goal` replaces the task's own. Throws InputError if it can't
  /// be read or names what does not exist.
  SkeletonSource(const symbolic::Task& task, std::optional<task::TemporalGoal> goal,
                 const SearchOptions& options);

  /// The next skeletons, cheapest first; none: see ended().
  std::vector<std::vector<ActionId>> NextBatch(const Limits& limits);
  /// From now on, skeletons that the conflict excludes are not yielded.
  void AddConflict(const task::Conflict& conflict);
  /// The caller tries this one itself: it is never yielded.
  void Exclude(const std::vector<ActionId>& actions) { yielded_.insert(actions); }
  /// Whether this source yields this sequence, which returns to a symbolic state.
  bool BringsReturn(const std::vector<ActionId>& actions) const {
    return returns_ && IsWorthReturning(actions);
  }
  /// A product of the caller's own, for questions about sequences of actions.
  std::unique_ptr<task::Product> MakeProduct() const;
  /// From now on, also yields skeletons that return to a symbolic state, if some action fails only as long as
  /// an object stays where it is, and another action moves that object without a symbolic effect that is
  /// needed. False if that changes nothing. Without a limit on the number of actions, up to three more than
  /// the longest yielded so far.
  bool AllowReturns();
  /// Why the last batch was not longer; kFound if only because batches are bounded.
  task::SearchStatus ended() const { return ended_; }

  uint64_t expanded() const { return earlier_expanded_ + search_->expanded(); }
  uint64_t generated() const { return earlier_generated_ + search_->generated(); }
  const task::SkeletonSearch& search() const { return *search_; }

 private:
  void Restart();
  /// Some skeleton, whatever its cost.
  task::SearchOutcome FindGreedily(const Limits& limits);
  task::SearchOutcome Next(const Limits& limits, std::optional<double> max_cost);
  bool IsWorthReturning(const std::vector<ActionId>& actions) const;

  const symbolic::Task& task_;
  std::optional<task::TemporalGoal> goal_;
  SearchOptions options_;
  std::unique_ptr<task::SkeletonSearch> search_;
  std::set<std::vector<ActionId>> yielded_;
  std::vector<task::Conflict> conflicts_;
  uint64_t earlier_expanded_ = 0, earlier_generated_ = 0;  // By searches that this one replaced.
  bool greedy_done_ = false;
  bool returns_ = false;  // Skeletons may come back to a symbolic state.
  int returns_left_ = 0;  // This many more of them may be examined.
  bool fresh_ = true;     // No conflict came since the search began.
  task::SearchStatus ended_ = task::SearchStatus::kFound;
};

}  // namespace tether::planning
