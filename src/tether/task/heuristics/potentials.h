#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tether/symbolic/grounding/mutex.h"
#include "tether/task/heuristics/relaxation.h"

namespace tether::task {

/// Weights on features of a state, and the changed costs of actions: c'(a) = c(a) plus the weights of the
/// features that `a` makes true, less those that it ends. Along a plan the weights telescope, so a lower
/// bound under the costs c' plus Offset() bounds the cost of the plan (Pommerening, Helmert, Röger and Seipp,
/// AAAI 2015: potentials and general cost partitioning). So costs move to where a relaxation sees them: if
/// being at the hub weighs 1, leaving it includes the cost of coming back, and each visit of a region counts
/// both moves.
///
/// Features are the atoms that are not derived, and the pairs of values of the relaxation's merge.
class Potentials {
 public:
  /// All must outlive this.
  Potentials(const Product& product, const Relaxation& relaxation, const symbolic::Mutexes& mutexes,
             const std::vector<symbolic::Variable>& variables);

  /// Sets of features whose weights are worth changing together.
  const std::vector<std::vector<int>>& directions() const { return directions_; }
  /// Adds `step` to the weights of `features`; if some cost became negative nothing is changed, and false
  /// returned.
  bool Shift(std::span<const int> features, int64_t step);

  /// c' per payer: at least 0.
  const std::vector<int64_t>& costs() const { return costs_; }
  /// To be added to a bound under costs(); may be negative.
  int64_t Offset(symbolic::StateView state) const;

 private:
  /// What an action may do: one of several pairs (feature ended, feature made), -1 where none is.
  using Change = std::vector<std::pair<int, int>>;

  void FindChanges(const Relaxation::Payer& payer, std::vector<Change>& changes) const;
  void FindGroups();
  void FindDirections();
  int64_t CostOf(size_t payer) const;
  int64_t GoalBound() const;
  int MergedFeature(int pair) const { return atoms_ + pair; }

  const Product& product_;
  const Relaxation& relaxation_;
  const symbolic::Mutexes& mutexes_;
  const std::vector<symbolic::Variable>& variables_;
  int atoms_ = 0;
  std::vector<std::vector<Change>> changes_;                ///< Per payer.
  std::vector<std::vector<int>> payers_of_;                 ///< Per feature.
  std::vector<std::vector<std::vector<int>>> goal_groups_;  ///< Per group, per choice: features that hold.
  std::vector<std::vector<int>> directions_;
  std::vector<int64_t> weights_, costs_;
  std::vector<int> weighted_;  ///< Atoms whose weight is not 0.
  int64_t goal_bound_ = 0;     ///< No goal state weighs more.
};

}  // namespace tether::task
