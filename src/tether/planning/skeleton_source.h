#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tether/planning/limits.h"
#include "tether/task/skeleton.h"

namespace tether::planning {

/// Brings the task search's skeletons in batches, whose sizes don't depend on the number of threads.
class SkeletonSource {
 public:
  /// `task` must outlive the source.
  SkeletonSource(const symbolic::Task& task, const SearchOptions& options);

  /// The next skeletons, cheapest first; none: see ended().
  std::vector<std::vector<int>> NextBatch(const Limits& limits);
  /// Nothing that begins with the conflict's prefix comes any more.
  void AddConflict(const task::Conflict& conflict);
  /// Why the last batch was not longer; kFound if only because batches are bounded.
  task::SearchStatus ended() const { return ended_; }

  uint64_t expanded() const { return search_->expanded(); }
  uint64_t generated() const { return search_->generated(); }

 private:
  void Restart();
  task::SearchOutcome Next(const Limits& limits, std::optional<double> max_cost);

  const symbolic::Task& task_;
  SearchOptions options_;
  std::unique_ptr<task::SkeletonSearch> search_;
  std::set<std::vector<int>> yielded_;
  std::vector<task::Conflict> conflicts_;
  bool fresh_ = true;  // No conflict came since the search began.
  task::SearchStatus ended_ = task::SearchStatus::kFound;
};

}  // namespace tether::planning
