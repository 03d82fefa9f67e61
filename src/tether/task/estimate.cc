#include "tether/task/estimate.h"

#include <algorithm>

namespace tether::task {

Estimate::Estimate(const Product& product, bool blind, bool unit_costs) : product_(product) {
  if (blind) return;
  cut_ = std::make_unique<Cut>(product, unit_costs);
  const std::vector<int64_t>& costs = cut_->relaxation.costs();
  if (costs.size() > 1) cheapest_ = *std::min_element(costs.begin(), costs.end() - 1);
}

int64_t Estimate::Evaluate(symbolic::StateView state, std::span<const int> before, int action) {
  if (!cut_) return 0;
  cut_->relaxation.FindFacts(state, facts_);
  const int64_t estimate = cut_->heuristic.Evaluate(facts_, before, action);
  if (product_.automaton() == nullptr || estimate == kDeadEnd) return estimate;
  return std::max(estimate, cheapest_ * product_.automaton()->LowerBound(product_.AutomatonState(state)));
}

}  // namespace tether::task
