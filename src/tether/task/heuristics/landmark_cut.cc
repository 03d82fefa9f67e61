#include "tether/task/heuristics/landmark_cut.h"

#include <algorithm>

namespace tether::task {
namespace {

constexpr int64_t kFar = LandmarkCut::kDeadEnd;

}  // namespace

LandmarkCut::LandmarkCut(const Relaxation& relaxation) : relaxation_(relaxation) {
  const size_t operators = relaxation.operators().size(), facts = static_cast<size_t>(relaxation.facts());
  std::vector<std::vector<int>> users(facts), adders(facts), of_payer(relaxation.costs().size());
  auto lay_out = [](const std::vector<int>& items, std::vector<int>& list, std::vector<Range>& ranges) {
    const int begin = static_cast<int>(list.size());
    list.insert(list.end(), items.begin(), items.end());
    ranges.push_back({begin, static_cast<int>(list.size())});
  };
  for (size_t i = 0; i < operators; ++i) {
    const Relaxation::Operator& op = relaxation.operators()[i];
    payer_.push_back(op.payer);
    fresh_.push_back(
        {relaxation.costs()[op.payer], 0, -1, static_cast<int>(op.preconditions.size()), -1, -1});
    lay_out(op.preconditions, precondition_list_, preconditions_);
    lay_out(op.adds, add_list_, adds_);
    for (int fact : op.preconditions) users[fact].push_back(static_cast<int>(i));
    for (int fact : op.adds) adders[fact].push_back(static_cast<int>(i));
    of_payer[op.payer].push_back(static_cast<int>(i));
  }
  for (const auto& list : users) lay_out(list, user_list_, users_);
  for (const auto& list : adders) lay_out(list, adder_list_, adders_);
  for (const auto& list : of_payer) lay_out(list, of_payer_list_, of_payer_);
  fact_cost_.resize(facts);
  supported_.resize(facts);
  zone_.resize(facts);
}

void LandmarkCut::SetCosts(std::span<const int64_t> costs) {
  for (size_t i = 0; i < fresh_.size(); ++i) {
    const auto payer = static_cast<size_t>(payer_[i]);
    if (payer < costs.size()) fresh_[i].cost = costs[payer];
  }
}

int64_t LandmarkCut::Evaluate(std::span<const int> facts, std::span<const int> before, ActionId action) {
  operators_ = fresh_;
  std::fill(supported_.begin(), supported_.end(), -1);
  landmarks_.clear();
  int64_t total = Keep(before, action);
  Explore(facts);
  const int goal = relaxation_.goal();
  if (fact_cost_[goal] == kFar) return kDeadEnd;
  while (fact_cost_[goal] > 0) {
    std::fill(zone_.begin(), zone_.end(), Zone::kNone);
    MarkGoalZone();
    FindCut(facts);
    int64_t least = kFar;
    for (int op : cut_) least = std::min(least, operators_[op].cost);
    total += least;
    Update(least);
  }
  return total;
}

/// Subtracts the costs of the landmarks that are kept, and returns their sum.
int64_t LandmarkCut::Keep(std::span<const int> before, ActionId action) {
  int64_t total = 0;
  for (size_t i = 0; i < before.size();) {
    const int cost = before[i];
    const auto landmark = before.subspan(i, 2 + static_cast<size_t>(before[i + 1]));
    const auto payers = landmark.subspan(2);
    i += landmark.size();
    if (std::any_of(payers.begin(), payers.end(),
                    [&](int payer) { return relaxation_.payers()[payer].action == action; }))
      continue;
    total += cost;
    landmarks_.insert(landmarks_.end(), landmark.begin(), landmark.end());
    for (int member : payers) {
      const Range own = of_payer_[member];
      for (int k = own.begin; k < own.end; ++k) {
        operators_[of_payer_list_[k]].cost -= cost;
      }
    }
  }
  return total;
}

void LandmarkCut::Propagate(int op) {
  const int64_t cost = operators_[op].supporter_cost + operators_[op].cost;
  for (int i = adds_[op].begin; i < adds_[op].end; ++i) {
    const int fact = add_list_[i];
    int64_t& known = fact_cost_[fact];
    if (known <= cost) continue;
    known = cost;
    queue_.Push(cost, fact);
  }
}

void LandmarkCut::Support(int fact, int op) {
  Operator& known = operators_[op];
  int& first = supported_[fact];
  known.supporter = fact;
  known.before = -1;
  known.next = first;
  if (first >= 0) operators_[first].before = op;
  first = op;
}

void LandmarkCut::Release(int op) {
  const Operator& known = operators_[op];
  if (known.before >= 0) {
    operators_[known.before].next = known.next;
  } else {
    supported_[known.supporter] = known.next;
  }
  if (known.next >= 0) operators_[known.next].before = known.before;
}

void LandmarkCut::Explore(std::span<const int> facts) {
  std::fill(fact_cost_.begin(), fact_cost_.end(), kFar);
  queue_.Clear();
  for (int fact : facts) {
    fact_cost_[fact] = 0;
    queue_.Push(0, fact);
  }
  while (!queue_.empty()) {
    const auto [cost, fact] = queue_.Pop();
    if (cost != fact_cost_[fact]) continue;
    for (int i = users_[fact].begin; i < users_[fact].end; ++i) {
      const int op = user_list_[i];
      // Facts come in the order of their costs: the last precondition is the most expensive.
      Operator& known = operators_[op];
      if (--known.missing > 0) continue;
      Support(fact, op);
      known.supporter_cost = cost;
      Propagate(op);
    }
  }
}

/// Subtracts the cut's cost from its actions, and updates the facts' costs.
void LandmarkCut::Update(int64_t least) {
  stack_.clear();
  for (int op : cut_) stack_.push_back(payer_[op]);
  std::sort(stack_.begin(), stack_.end());
  stack_.erase(std::unique(stack_.begin(), stack_.end()), stack_.end());
  if (least <= std::numeric_limits<int>::max()) {
    landmarks_.push_back(static_cast<int>(least));
    landmarks_.push_back(static_cast<int>(stack_.size()));
    landmarks_.insert(landmarks_.end(), stack_.begin(), stack_.end());
  }
  for (int payer : stack_) {
    const Range own = of_payer_[payer];
    for (int i = own.begin; i < own.end; ++i) {
      const int op = of_payer_list_[i];
      Operator& known = operators_[op];
      known.cost -= least;
      if (known.missing == 0) Propagate(op);
    }
  }
  while (!queue_.empty()) {
    const auto [cost, fact] = queue_.Pop();
    if (cost != fact_cost_[fact]) continue;
    for (int op = supported_[fact], next = -1; op >= 0; op = next) {
      Operator& known = operators_[op];
      next = known.next;
      if (known.supporter_cost <= cost) continue;
      int dearest = fact;
      for (int k = preconditions_[op].begin; k < preconditions_[op].end; ++k) {
        const int other = precondition_list_[k];
        if (fact_cost_[other] > fact_cost_[dearest]) dearest = other;
      }
      if (dearest != fact) {
        Release(op);
        Support(dearest, op);
      }
      const int64_t now = fact_cost_[dearest];
      if (now == known.supporter_cost) continue;
      known.supporter_cost = now;
      Propagate(op);
    }
  }
}

/// Marks the goal zone: the facts from which the goal costs nothing.
void LandmarkCut::MarkGoalZone() {
  stack_.assign(1, relaxation_.goal());
  zone_[relaxation_.goal()] = Zone::kGoal;
  while (!stack_.empty()) {
    const int fact = stack_.back();
    stack_.pop_back();
    for (int i = adders_[fact].begin; i < adders_[fact].end; ++i) {
      const int op = adder_list_[i];
      const Operator& known = operators_[op];
      if (known.cost > 0 || known.missing > 0) continue;
      const int supporter = known.supporter;
      Zone& zone = zone_[supporter];
      if (zone == Zone::kGoal) continue;
      zone = Zone::kGoal;
      stack_.push_back(supporter);
    }
  }
}

/// The cut: the operators that lead into the goal zone from facts that are reachable outside of it.
void LandmarkCut::FindCut(std::span<const int> facts) {
  cut_.clear();
  stack_.assign(facts.begin(), facts.end());
  for (int fact : facts) zone_[fact] = Zone::kBefore;
  while (!stack_.empty()) {
    const int fact = stack_.back();
    stack_.pop_back();
    for (int op = supported_[fact]; op >= 0; op = operators_[op].next) {
      const int* begin = add_list_.data() + adds_[op].begin;
      const int* end = add_list_.data() + adds_[op].end;
      if (std::any_of(begin, end, [&](int add) { return zone_[add] == Zone::kGoal; })) {
        cut_.push_back(op);
        continue;
      }
      for (const int* add = begin; add != end; ++add) {
        Zone& zone = zone_[*add];
        if (zone != Zone::kNone) continue;
        zone = Zone::kBefore;
        stack_.push_back(*add);
      }
    }
  }
}

}  // namespace tether::task
