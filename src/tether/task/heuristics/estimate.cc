#include "tether/task/heuristics/estimate.h"

#include <algorithm>
#include <utility>

namespace tether::task {
namespace {

using symbolic::Variable;

constexpr size_t kMostPairs = 1000;                    ///< Of values of a merge.
constexpr size_t kMostWork = 20'000'000;               ///< Comparisons of an action with two variables.
constexpr size_t kMostMerges = 4;                      ///< That are tried.
constexpr size_t kMostPayers = 20'000;                 ///< Of a relaxation.
constexpr size_t kMostTouched = 1'000'000;             ///< Operators in all evaluations of a climb.
constexpr int64_t kWorthOfDeadEnd = int64_t{1} << 40;  ///< More than any other estimate.
constexpr size_t kHopeless = 500;   ///< Evaluations without a gain after which climbing ends.
constexpr int64_t kLargeGain = 20;  ///< One part in this many.
constexpr int64_t kLeastGain = 25;  ///< Directions that gain less than one part in this many are dropped.

/// Which actions read and which change a variable.
struct Uses {
  std::vector<bool> asks, changes;  ///< By action.
  bool sometimes = false;           ///< A conditional effect changes it.
};

Uses FindUses(const symbolic::Task& task, const Variable& variable) {
  Uses uses;
  for (const symbolic::GroundAction& action : task.actions()) {
    uses.changes.push_back(Changes(action, variable));
    uses.asks.push_back(Asks(action, variable));
    for (const symbolic::GroundEffect& effect : action.effects)
      uses.sometimes = uses.sometimes || (!effect.condition.always() && Changes(effect, variable));
  }
  return uses;
}

}  // namespace

Estimate::Estimate(const Product& product, bool blind, bool unit_costs)
    : product_(product), unit_costs_(unit_costs) {
  if (blind) return;
  cut_ = std::make_unique<Cut>(product, unit_costs);
  const std::vector<int64_t>& costs = cut_->relaxation.costs();
  if (costs.size() > 1) cheapest_ = *std::min_element(costs.begin(), costs.end() - 1);
}

int64_t Estimate::Evaluate(Cut& cut, symbolic::StateView state, std::span<const int> before,
                           ActionId action) {
  cut.relaxation.FindFacts(state, facts_);
  const int64_t estimate = cut.heuristic.Evaluate(facts_, before, action);
  if (!cut.potentials || estimate == kDeadEnd) return estimate;
  return std::max<int64_t>(estimate + cut.potentials->Offset(state), 0);
}

int64_t Estimate::Evaluate(symbolic::StateView state, std::span<const int> before, ActionId action) {
  if (!cut_) return 0;
  const int64_t estimate = Evaluate(*cut_, state, before, action);
  if (product_.automaton() == nullptr || estimate == kDeadEnd) return estimate;
  return std::max(estimate, cheapest_ * product_.automaton()->LowerBound(product_.AutomatonState(state)));
}

int64_t Estimate::Sum(Cut& cut, std::span<const symbolic::State> samples) {
  int64_t sum = 0;
  for (const symbolic::State& state : samples) {
    const int64_t estimate = Evaluate(cut, state, {}, {});
    sum += estimate == kDeadEnd ? kWorthOfDeadEnd : estimate;
  }
  return sum;
}

/// Pairs of variables each of which is asked for where the other changes, those with most such actions first.
std::vector<Merge> Estimate::FindMerges() const {
  const std::vector<Variable>& variables = invariants_->variables;
  if (variables.size() * variables.size() * product_.task().actions().size() > kMostWork) return {};
  std::vector<Uses> uses;
  for (const Variable& variable : variables) uses.push_back(FindUses(product_.task(), variable));
  std::vector<std::pair<size_t, Merge>> found;
  for (size_t i = 0; i < variables.size(); ++i) {
    for (size_t k = i + 1; k < variables.size(); ++k) {
      Merge merge{variables[i], variables[k]};
      if (uses[i].sometimes || uses[k].sometimes || merge.values() > kMostPairs) continue;
      const bool apart = std::none_of(merge.first.atoms.begin(), merge.first.atoms.end(),
                                      [&](int atom) { return Contains(merge.second.atoms, atom); });
      if (!apart) continue;
      size_t first = 0, second = 0;
      for (size_t a = 0; a < product_.task().actions().size(); ++a) {
        first += uses[i].changes[a] && !uses[k].changes[a] && uses[k].asks[a];
        second += uses[k].changes[a] && !uses[i].changes[a] && uses[i].asks[a];
      }
      if (first > 0 && second > 0) found.emplace_back(first + second, std::move(merge));
    }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<Merge> merges;
  for (size_t i = 0; i < std::min(found.size(), kMostMerges); ++i)
    merges.push_back(std::move(found[i].second));
  return merges;
}

/// For each part of the goal's automaton a variable that says all that it reads, if there is one.
std::vector<Tracking> Estimate::FindTrackings(const std::optional<Merge>& merge) const {
  std::vector<Tracking> trackings;
  for (int part = 0; product_.automaton() != nullptr && part < product_.automaton()->parts(); ++part) {
    for (const Variable& variable : invariants_->variables) {
      auto tracking = Tracking::Make(product_, part, variable, merge, invariants_->mutexes);
      if (!tracking || tracking->entries() > 2 * kMostPairs) continue;
      trackings.push_back(std::move(*tracking));
      break;
    }
  }
  return trackings;
}

/// The best merge, and then each tracking that makes a difference.
std::unique_ptr<Estimate::Cut> Estimate::FindRefinement(std::span<const symbolic::State> samples) {
  const symbolic::Mutexes& mutexes = invariants_->mutexes;
  auto best = std::make_unique<Cut>(product_, unit_costs_);
  int64_t sum = Sum(*best, samples);
  std::optional<Merge> merge;
  std::vector<Tracking> trackings;
  const auto improve = [&](const std::optional<Merge>& with, const std::vector<Tracking>& tracked,
                           int64_t least) {
    auto cut = std::make_unique<Cut>(product_, unit_costs_, with, tracked, mutexes);
    if (cut->relaxation.payers().size() > kMostPayers) return false;
    const int64_t own = Sum(*cut, samples);
    if (own < sum + std::max<int64_t>(least, 1)) return false;
    sum = own;
    best = std::move(cut);
    return true;
  };
  for (const Merge& candidate : FindMerges()) {
    if (improve(candidate, {}, 0)) merge = candidate;
  }
  for (const Tracking& candidate : FindTrackings(merge)) {
    trackings.push_back(candidate);
    if (!improve(merge, trackings, sum / kLeastGain)) trackings.pop_back();
  }
  best->potentials =
      std::make_unique<Potentials>(product_, best->relaxation, mutexes, invariants_->variables);
  return best;
}

/// Changes weights one after another as long as the sum grows, and returns it with what was done.
int64_t Estimate::Climb(Cut& cut, std::span<const symbolic::State> samples, int64_t sum,
                        size_t max_evaluations, std::vector<Shift>& done) {
  Potentials& potentials = *cut.potentials;
  int64_t step = kDeadEnd;
  for (int64_t cost : cut.relaxation.costs()) {
    if (cost > 0) step = std::min(step, cost);
  }
  if (step == kDeadEnd) return sum;
  // A climb can't be interrupted: some 1 s at most.
  max_evaluations = std::min(max_evaluations, kMostTouched / (cut.relaxation.operators().size() + 1));
  const size_t count = potentials.directions().size();
  size_t evaluations = 0, last_gain = 0;
  for (size_t i = 0, idle = 0; idle < count; i = (i + 1) % count, ++idle) {
    for (const int64_t change : {-step, step}) {
      if (evaluations + samples.size() > max_evaluations || evaluations > last_gain + kHopeless) return sum;
      if (!potentials.Shift(potentials.directions()[i], change)) continue;
      cut.heuristic.SetCosts(potentials.costs());
      evaluations += samples.size();
      const int64_t now = Sum(cut, samples);
      if (now > sum) {
        done.push_back({i, change});
        idle = 0;
        last_gain = evaluations;
        // After a large step others may be worth while that were not before: the first ones shift most.
        if (now - sum > sum / kLargeGain) i = count - 1;
        sum = now;
        break;
      }
      potentials.Shift(potentials.directions()[i], -change);
      cut.heuristic.SetCosts(potentials.costs());
    }
  }
  return sum;
}

bool Estimate::Strengthen(std::span<const symbolic::State> samples,
                          const std::vector<symbolic::AtomPermutation>& exchanges, size_t max_evaluations) {
  if (!cut_ || samples.empty()) return false;
  if (!invariants_) {
    auto mutexes = symbolic::Mutexes::Find(product_.task(), exchanges);
    if (!mutexes) return false;
    auto variables = symbolic::FindVariables(product_.task(), *mutexes, exchanges);
    invariants_ = std::make_unique<Invariants>(Invariants{std::move(*mutexes), std::move(variables)});
  }
  const int64_t before = Sum(*cut_, samples);
  int64_t sum = before;
  std::unique_ptr<Cut> fresh;
  if (generation_ == 0) {
    fresh = FindRefinement(samples);
    sum = Sum(*fresh, samples);
  }
  Cut& cut = fresh ? *fresh : *cut_;
  std::vector<Shift> done;
  sum = Climb(cut, samples, sum, max_evaluations, done);
  if (sum - before < std::max<int64_t>(before / kLeastGain, 1)) {
    // Backwards, so that no cost becomes negative in between.
    std::reverse(done.begin(), done.end());
    for (const Shift& shift : done)
      cut.potentials->Shift(cut.potentials->directions()[shift.direction], -shift.change);
    cut.heuristic.SetCosts(cut.potentials->costs());
    return false;
  }
  if (fresh) cut_ = std::move(fresh);
  ++generation_;
  return true;
}

}  // namespace tether::task
