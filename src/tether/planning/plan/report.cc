#include "tether/planning/plan/report.h"

#include <algorithm>
#include <numeric>

namespace tether::planning {

std::string ToString(CandidateStatus status) {
  switch (status) {
    case CandidateStatus::kFeasible:
      return "feasible";
    case CandidateStatus::kInfeasible:
      return "infeasible";
    case CandidateStatus::kGaveUp:
      return "gave_up";
    case CandidateStatus::kPruned:
      return "pruned";
  }
  return "gave_up";
}

std::string ToString(PlanStatus status) {
  switch (status) {
    case PlanStatus::kNotCalled:
      return "not_called";
    case PlanStatus::kSolved:
      return "solved";
    case PlanStatus::kImpossible:
      return "impossible";
    case PlanStatus::kGaveUp:
      return "gave_up";
    case PlanStatus::kInterrupted:
      return "interrupted";
  }
  return "not_called";
}

std::vector<int> PlanReport::BestFirst() const {
  std::vector<int> order(candidates.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int i, int j) {
    const CandidateReport &a = candidates[i], &b = candidates[j];
    if (a.feasible() != b.feasible()) return a.feasible();
    return a.feasible() && a.plan.cost < b.plan.cost;
  });
  return order;
}

const CandidateReport* PlanReport::best() const {
  const std::vector<int> order = BestFirst();
  if (order.empty()) return nullptr;
  const CandidateReport& first = candidates[order.front()];
  return first.feasible() ? &first : nullptr;
}

}  // namespace tether::planning
