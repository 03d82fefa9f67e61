#include "tether/task/heuristics/potentials.h"

#include <algorithm>
#include <map>

#include "tether/common/limits.h"

namespace tether::task {
namespace {

using symbolic::Literal;
using symbolic::Variable;

}  // namespace

Potentials::Potentials(const Product& product, const Relaxation& relaxation, const symbolic::Mutexes& mutexes,
                       const std::vector<Variable>& variables)
    : product_(product),
      relaxation_(relaxation),
      mutexes_(mutexes),
      variables_(variables),
      atoms_(static_cast<int>(product.task().atoms().size())) {
  const size_t pairs = relaxation.merge() == nullptr ? 0 : relaxation.merge()->values();
  weights_.assign(static_cast<size_t>(atoms_) + pairs, 0);
  payers_of_.resize(weights_.size());
  for (const Relaxation::Payer& payer : relaxation.payers()) {
    PollLimits();
    const int index = static_cast<int>(changes_.size());
    FindChanges(payer, changes_.emplace_back());
    for (const Change& change : changes_.back()) {
      for (const auto& [ended, made] : change) {
        for (int feature : {ended, made}) {
          if (feature < 0) continue;
          std::vector<int>& list = payers_of_[feature];
          if (list.empty() || list.back() != index) list.push_back(index);
        }
      }
    }
  }
  for (size_t i = 0; i < changes_.size(); ++i) costs_.push_back(CostOf(i));
  FindGroups();
  FindDirections();
}

void Potentials::FindChanges(const Relaxation::Payer& payer, std::vector<Change>& changes) const {
  const symbolic::GroundAction& action = product_.task().actions()[payer.action];
  std::vector<int> known = symbolic::NecessaryLiterals(action.precondition);
  const Merge* merge = relaxation_.merge();
  if (payer.from >= 0) {
    const auto from = static_cast<size_t>(payer.from);
    AppendLiterals(merge->first, merge->First(from), known);
    AppendLiterals(merge->second, merge->Second(from), known);
    if (payer.from != payer.to) changes.push_back({{MergedFeature(payer.from), MergedFeature(payer.to)}});
  }
  const auto holds = [&](int atom) { return Contains(known, Literal(atom, true)); };
  const auto fails = [&](int atom) {
    return std::any_of(known.begin(), known.end(),
                       [&](int literal) { return mutexes_.AreMutex(Literal(atom, true), literal); });
  };
  std::vector<int> adds, deletes;
  for (const symbolic::GroundEffect& effect : action.effects) {
    if (!effect.condition.always()) continue;
    adds.insert(adds.end(), effect.adds.begin(), effect.adds.end());
    deletes.insert(deletes.end(), effect.deletes.begin(), effect.deletes.end());
  }
  const auto tidy = [](std::vector<int>& list) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  };
  tidy(adds);
  tidy(deletes);
  std::erase_if(deletes, [&](int atom) { return Contains(adds, atom) || fails(atom); });
  for (int atom : adds) {
    if (holds(atom)) continue;
    changes.push_back({{-1, atom}});
    if (!fails(atom)) changes.back().push_back({-1, -1});
  }
  for (int atom : deletes) {
    if (holds(atom)) changes.push_back({{atom, -1}});
  }
  std::erase_if(deletes, holds);
  // If they are values of one variable, at most one of them holds.
  for (const Variable& variable : variables_) {
    if (deletes.size() < 2) break;
    Change change;
    bool other = !variable.exactly_one;
    for (int atom : variable.atoms) {
      if (Contains(deletes, atom)) {
        change.push_back({atom, -1});
      } else {
        other = other || !fails(atom);
      }
    }
    if (change.size() < 2) continue;
    if (other) change.push_back({-1, -1});
    std::erase_if(deletes, [&](int atom) { return Contains(variable.atoms, atom); });
    changes.push_back(std::move(change));
  }
  for (int atom : deletes) changes.push_back({{atom, -1}, {-1, -1}});
  for (const symbolic::GroundEffect& effect : action.effects) {
    if (effect.condition.always()) continue;
    for (int atom : effect.adds) {
      if (!Contains(adds, atom)) changes.push_back({{-1, atom}, {-1, -1}});
    }
    for (int atom : effect.deletes) {
      if (!Contains(adds, atom)) changes.push_back({{atom, -1}, {-1, -1}});
    }
  }
}

/// Groups of choices (sets of features): at most one choice of a group holds in a goal state.
void Potentials::FindGroups() {
  std::vector<int> literals;
  if (product_.automaton() == nullptr) literals = symbolic::NecessaryLiterals(product_.task().goal());
  const auto may_hold = [&](int atom) {
    return std::none_of(literals.begin(), literals.end(),
                        [&](int literal) { return mutexes_.AreMutex(Literal(atom, true), literal); });
  };
  std::vector<bool> covered(atoms_, false);
  const auto cover = [&](const Variable& variable) {
    for (int atom : variable.atoms) covered[atom] = true;
  };
  if (const Merge* merge = relaxation_.merge()) {
    std::vector<std::vector<int>>& choices = goal_groups_.emplace_back();
    for (size_t pair = 0; pair < merge->values(); ++pair) {
      const size_t first = merge->First(pair), second = merge->Second(pair);
      std::vector<int> features = {MergedFeature(static_cast<int>(pair))};
      if (first < merge->first.atoms.size()) features.push_back(merge->first.atoms[first]);
      if (second < merge->second.atoms.size()) features.push_back(merge->second.atoms[second]);
      const bool possible =
          !relaxation_.IsImpossible(pair) && std::all_of(features.begin() + 1, features.end(), may_hold);
      if (possible) choices.push_back(std::move(features));
    }
    cover(merge->first);
    cover(merge->second);
  }
  for (const Variable& variable : variables_) {
    const auto fresh =
        std::count_if(variable.atoms.begin(), variable.atoms.end(), [&](int atom) { return !covered[atom]; });
    if (fresh < 2) continue;
    std::vector<std::vector<int>>& choices = goal_groups_.emplace_back();
    bool none = !variable.exactly_one, wanted = false;
    for (int atom : variable.atoms) {
      if (!may_hold(atom)) continue;
      if (covered[atom]) {
        none = true;
      } else {
        choices.push_back({atom});
        wanted = wanted || Contains(literals, Literal(atom, true));
      }
    }
    if (none && !wanted) choices.emplace_back();
    cover(variable);
  }
  for (int atom = 0; atom < atoms_; ++atom) {
    if (covered[atom]) continue;
    std::vector<std::vector<int>>& choices = goal_groups_.emplace_back();
    if (may_hold(atom)) choices.push_back({atom});
    if (!Contains(literals, Literal(atom, true))) choices.emplace_back();
  }
}

/// Each feature alone, and those of one predicate.
void Potentials::FindDirections() {
  std::map<int, std::vector<int>> by_predicate;
  std::vector<std::vector<int>> alone;
  for (size_t i = 0; i < weights_.size(); ++i) {
    if (payers_of_[i].empty()) continue;
    const int feature = static_cast<int>(i);
    alone.push_back({feature});
    if (feature < atoms_) by_predicate[product_.task().atoms()[i].predicate].push_back(feature);
  }
  for (auto& [predicate, features] : by_predicate) {
    if (features.size() > 1) directions_.push_back(std::move(features));
  }
  directions_.insert(directions_.end(), alone.begin(), alone.end());
}

int64_t Potentials::CostOf(size_t payer) const {
  int64_t cost = relaxation_.costs()[payer];
  for (const Change& change : changes_[payer]) {
    int64_t least = 0;
    bool any = false;
    for (const auto& [ended, made] : change) {
      const int64_t now = (made < 0 ? 0 : weights_[made]) - (ended < 0 ? 0 : weights_[ended]);
      least = any ? std::min(least, now) : now;
      any = true;
    }
    cost += least;
  }
  return cost;
}

int64_t Potentials::GoalBound() const {
  int64_t bound = 0;
  for (const std::vector<std::vector<int>>& choices : goal_groups_) {
    std::optional<int64_t> most;
    for (const std::vector<int>& features : choices) {
      int64_t weight = 0;
      for (int feature : features) weight += weights_[feature];
      most = std::max(most.value_or(weight), weight);
    }
    bound += most.value_or(0);
  }
  return bound;
}

bool Potentials::Shift(std::span<const int> features, int64_t step) {
  PollLimits();  // Here nothing is half done.
  for (int feature : features) weights_[feature] += step;
  bool valid = true;
  for (int feature : features) {
    for (int payer : payers_of_[feature]) {
      const auto p = static_cast<size_t>(payer);
      costs_[p] = CostOf(p);
      valid = valid && costs_[p] >= 0;
    }
  }
  if (!valid) {
    for (int feature : features) weights_[feature] -= step;
    for (int feature : features) {
      for (int payer : payers_of_[feature]) costs_[payer] = CostOf(payer);
    }
    return false;
  }
  weighted_.clear();
  for (int atom = 0; atom < atoms_; ++atom) {
    if (weights_[atom] != 0) weighted_.push_back(atom);
  }
  goal_bound_ = GoalBound();
  return true;
}

int64_t Potentials::Offset(symbolic::StateView state) const {
  int64_t weight = 0;
  for (int atom : weighted_) {
    const auto i = static_cast<size_t>(atom);
    if ((state[i / 64] >> (i % 64) & 1) != 0) weight += weights_[i];
  }
  if (const Merge* merge = relaxation_.merge()) {
    weight += weights_[MergedFeature(static_cast<int>(merge->Find(state)))];
  }
  return weight - goal_bound_;
}

}  // namespace tether::task
