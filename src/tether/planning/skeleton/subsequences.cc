#include "tether/planning/skeleton/subsequences.h"

#include <algorithm>
#include <set>
#include <utility>

namespace tether::planning {
namespace {

template <typename T>
auto At(std::vector<T>& values, size_t index) {
  return values.begin() + static_cast<std::ptrdiff_t>(index);
}

}  // namespace

Subsequences::Subsequences(std::unique_ptr<task::Product> product)
    : product_(std::move(product)), start_(product_->Start()) {}

bool Subsequences::Step(ActionId action, const symbolic::State& state, symbolic::State& next) {
  const symbolic::Task& task = product_->task();
  if (product_->IsForbidden(action) ||
      !task.IsApplicable(action, symbolic::StateView(state).first(task.words())))
    return false;
  next.resize(state.size());
  return product_->Apply(action, state, next);
}

std::vector<Subsequence> Subsequences::Find(const std::vector<ActionId>& actions) {
  found_.clear();
  if (!start_ || actions.empty()) return {};
  whole_ = &actions;
  if (actions.size() <= kExact) {
    part_.clear();
    states_.assign(actions.size() + 1, *start_);
    FindFrom(0);
  } else {
    std::vector<ActionId> rest = actions;
    for (size_t i = 0; i < actions.size(); ++i) Add(Eliminate(actions, i));
    for (size_t i = 0; i < rest.size();) {
      std::vector<ActionId> less = Eliminate(rest, i);
      if (less.empty()) {
        ++i;
      } else {
        Add(rest = std::move(less));
      }
    }
  }
  std::stable_sort(found_.begin(), found_.end(), [](const Subsequence& a, const Subsequence& b) {
    return a.actions.size() != b.actions.size() ? a.actions.size() < b.actions.size() : a.actions < b.actions;
  });
  found_.erase(std::unique(found_.begin(), found_.end(),
                           [](const Subsequence& a, const Subsequence& b) { return a.actions == b.actions; }),
               found_.end());
  return std::move(found_);
}

/// Enumerates: each action from `index` on is appended to `part_` or left out.
void Subsequences::FindFrom(size_t index) {
  const symbolic::State& state = states_[part_.size()];
  if (product_->IsGoal(state)) {
    if (part_.size() < whole_->size()) Add(part_);
    return;
  }
  for (size_t i = index; i < whole_->size(); ++i) {
    if (!Step((*whole_)[i], state, states_[part_.size() + 1])) continue;
    part_.push_back((*whole_)[i]);
    FindFrom(i + 1);
    part_.pop_back();
  }
}

std::vector<ActionId> Subsequences::Eliminate(const std::vector<ActionId>& actions, size_t index) {
  std::vector<ActionId> kept(actions.begin(), actions.begin() + static_cast<std::ptrdiff_t>(index));
  symbolic::State state = *start_, next;
  for (size_t i = 0; i < actions.size(); ++i) {
    if (product_->IsGoal(state)) break;
    if (i == index || !Step(actions[i], state, next)) continue;
    if (i > index) kept.push_back(actions[i]);
    std::swap(state, next);
  }
  return product_->IsGoal(state) ? kept : std::vector<ActionId>();
}

void Subsequences::Add(std::vector<ActionId> actions) {
  if (actions.empty() && !product_->IsGoal(*start_)) return;
  const bool revisits = Revisits(actions);
  found_.push_back({std::move(actions), revisits});
}

bool Subsequences::Revisits(const std::vector<ActionId>& actions) {
  States states = Trace(actions);
  std::sort(states.begin(), states.end());
  return std::adjacent_find(states.begin(), states.end()) != states.end();
}

Subsequences::States Subsequences::Trace(const std::vector<ActionId>& actions) {
  States states{*start_};
  symbolic::State next;
  for (const ActionId action : actions) {
    if (!Step(action, states.back(), next)) break;
    states.push_back(next);
  }
  return states;
}

template <typename Want, typename Visit>
void Subsequences::ForEachExchange(const std::vector<ActionId>& actions, const States& states, Want want,
                                   Visit visit) {
  const size_t n = actions.size();
  States between;
  symbolic::State next;
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = i + 1; j < n; ++j) {
      if (!want(actions[i], actions[j]) || !Step(actions[j], states[i], next)) continue;
      // The second part first, as far as it is applicable; then the first one.
      between = {next};
      for (size_t k = j + 1; k <= n; ++k) {
        const size_t second = between.size();
        bool done = true;
        for (size_t l = i; l < j && done; ++l) {
          done = !product_->IsGoal(between.back()) && Step(actions[l], between.back(), next);
          if (done) between.push_back(next);
        }
        if (done && between.back() == states[k] && !visit(i, j, k, between)) return;
        between.resize(second);
        if (k == n || product_->IsGoal(between.back()) || !Step(actions[k], between.back(), next)) break;
        between.push_back(next);
      }
    }
  }
}

std::vector<ActionId> Subsequences::NormalOrder(std::vector<ActionId> actions) {
  if (!start_) return actions;
  States states = Trace(actions);
  if (states.size() != actions.size() + 1) return actions;
  for (bool changed = true; changed;) {
    changed = false;
    ForEachExchange(
        actions, states, [](ActionId first, ActionId second) { return second < first; },
        [&](size_t i, size_t j, size_t k, const States& between) {
          std::rotate(At(actions, i), At(actions, j), At(actions, k));
          std::copy(between.begin(), between.end(), At(states, i + 1));
          changed = true;
          return false;
        });
  }
  return actions;
}

std::vector<std::vector<ActionId>> Subsequences::Exchanged(const std::vector<ActionId>& actions) {
  std::vector<std::vector<ActionId>> all;
  if (!start_) return all;
  const States states = Trace(actions);
  if (states.size() != actions.size() + 1) return all;
  ForEachExchange(
      actions, states, [](ActionId, ActionId) { return true; },
      [&](size_t i, size_t j, size_t k, const States&) {
        std::vector<ActionId> other = actions;
        std::rotate(At(other, i), At(other, j), At(other, k));
        all.push_back(std::move(other));
        return true;
      });
  return all;
}

}  // namespace tether::planning
