#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "tether/task/heuristics/relaxation.h"
#include "tether/task/heuristics/relaxed_queue.h"

namespace tether::task {

/// The heuristic of the FF planner (Hoffmann and Nebel, JAIR 2001), with supporters chosen by additive costs:
/// the cost of a plan of the delete relaxation. Not admissible; fast and informative.
class RelaxedPlan {
 public:
  static constexpr int64_t kDeadEnd = std::numeric_limits<int64_t>::max();

  /// `relaxation` must outlive this and have no merge.
  explicit RelaxedPlan(const Relaxation& relaxation);

  /// kDeadEnd if not even the relaxation has a plan. Then and before the first call actions() is empty.
  int64_t Evaluate(std::span<const int> facts);
  /// The actions with which the last relaxed plan begins, in increasing order: worth trying first.
  const std::vector<ActionId>& actions() const { return actions_; }

 private:
  const Relaxation& relaxation_;
  std::vector<std::vector<int>> users_;  ///< Operators by precondition.
  std::vector<int64_t> costs_;           ///< By action.
  std::vector<int64_t> fact_cost_, operator_cost_;
  std::vector<int> missing_;
  std::vector<int> best_;  ///< By fact: the operator that adds it most cheaply, -1 if it holds.
  std::vector<bool> needed_;
  std::vector<int> stack_, payers_;
  std::vector<ActionId> actions_;
  RelaxedQueue queue_;
};

}  // namespace tether::task
