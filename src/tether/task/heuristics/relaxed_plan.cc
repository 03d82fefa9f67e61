#include "tether/task/heuristics/relaxed_plan.h"

#include <algorithm>

namespace tether::task {
namespace {

template <typename T>
void SortUnique(std::vector<T>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

}  // namespace

RelaxedPlan::RelaxedPlan(const Relaxation& relaxation)
    : relaxation_(relaxation), users_(relaxation.facts()), costs_(relaxation.costs()) {
  for (size_t i = 0; i < relaxation.operators().size(); ++i) {
    for (int fact : relaxation.operators()[i].preconditions) {
      users_[fact].push_back(static_cast<int>(i));
    }
  }
  // Where costs differ, each step counts too, against long plans of cheap actions.
  costs_.pop_back();
  if (std::any_of(costs_.begin(), costs_.end(), [](int64_t cost) { return cost != 1; })) {
    for (int64_t& cost : costs_) ++cost;
  }
  costs_.push_back(0);
  fact_cost_.resize(users_.size());
  best_.resize(users_.size());
  operator_cost_.resize(relaxation.operators().size());
  missing_.resize(relaxation.operators().size());
}

int64_t RelaxedPlan::Evaluate(std::span<const int> facts) {
  const std::vector<Relaxation::Operator>& operators = relaxation_.operators();
  actions_.clear();
  std::fill(fact_cost_.begin(), fact_cost_.end(), kDeadEnd);
  std::fill(best_.begin(), best_.end(), -1);
  for (size_t i = 0; i < operators.size(); ++i) {
    missing_[i] = static_cast<int>(operators[i].preconditions.size());
    operator_cost_[i] = costs_[operators[i].payer];
  }
  queue_.Clear();
  for (int fact : facts) {
    fact_cost_[fact] = 0;
    queue_.Push(0, fact);
  }
  while (!queue_.empty()) {
    const auto [cost, fact] = queue_.Pop();
    if (cost != fact_cost_[fact]) continue;
    if (fact == relaxation_.goal()) break;
    for (int user : users_[fact]) {
      const auto op = static_cast<size_t>(user);
      operator_cost_[op] += cost;
      if (--missing_[op] > 0) continue;
      for (int add : operators[op].adds) {
        int64_t& known = fact_cost_[add];
        if (known <= operator_cost_[op]) continue;
        known = operator_cost_[op];
        best_[add] = user;
        queue_.Push(known, add);
      }
    }
  }
  if (fact_cost_[relaxation_.goal()] == kDeadEnd) return kDeadEnd;

  needed_.assign(users_.size(), false);
  payers_.clear();
  stack_.assign(1, relaxation_.goal());
  needed_[relaxation_.goal()] = true;
  const int free = static_cast<int>(costs_.size()) - 1;
  while (!stack_.empty()) {
    const int fact = stack_.back();
    stack_.pop_back();
    const int chosen = best_[fact];
    if (chosen < 0) continue;
    const Relaxation::Operator& op = operators[chosen];
    bool applies = op.payer != free;
    for (int before : op.preconditions) {
      applies = applies && fact_cost_[before] == 0;
      if (needed_[before]) continue;
      needed_[before] = true;
      stack_.push_back(before);
    }
    if (op.payer != free) payers_.push_back(op.payer);
    if (applies) actions_.push_back(relaxation_.payers()[ToIndex(op.payer)].action);
  }
  SortUnique(payers_);
  SortUnique(actions_);
  int64_t total = 0;
  for (int payer : payers_) total += costs_[payer];
  return total;
}

}  // namespace tether::task
