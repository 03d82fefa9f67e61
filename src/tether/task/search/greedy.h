#pragma once

#include <cstdint>
#include <memory>

#include "tether/task/goal/product.h"
#include "tether/task/search/skeleton.h"

namespace tether::task {

struct GreedyResult {
  SearchStatus status = SearchStatus::kExhausted;  ///< kExhausted: proved that there is no skeleton.
  std::optional<Skeleton> skeleton;                ///< With kFound; not the cheapest as a rule.
  uint64_t expanded = 0;
  uint64_t generated = 0;
};

/// Finds some skeleton fast: greedy best-first search by the FF heuristic, where states are evaluated when
/// they are expanded and wait under their parents' estimates, and actions of relaxed plans are tried first
/// (Richter and Helmert, ICAPS 2009). Ignores SearchLimits::max_cost.
GreedyResult FindGreedily(Product& product, const SearchLimits& limits = {}, size_t max_states = 20'000'000);

}  // namespace tether::task
