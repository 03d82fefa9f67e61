#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "tether/task/heuristics/relaxation.h"
#include "tether/task/heuristics/relaxed_queue.h"

namespace tether::task {

/// The landmark-cut heuristic of Helmert and Domshlak (ICAPS 2009, section 5): an admissible estimate of the
/// cost to the goal. Round after round, it finds a set of actions of which every relaxed plan needs one; the
/// least of their costs is added to the estimate and subtracted from each of them.
///
/// Several operators may share a payer (conditional effects) and thereby its cost, so that one action is
/// never counted twice.
class LandmarkCut {
 public:
  static constexpr int64_t kDeadEnd = std::numeric_limits<int64_t>::max();

  /// `relaxation` must outlive this.
  explicit LandmarkCut(const Relaxation& relaxation);

  /// Landmarks as numbers: for each its cost, how many payers it has, and these. Every plan needs one of
  /// them.
  using Landmarks = std::vector<int>;

  /// Other costs than the relaxation's, one per payer, not negative. Landmarks from before are void.
  void SetCosts(std::span<const int64_t> costs);

  /// A lower bound on the cost of a plan from where `facts` hold; kDeadEnd if there is none even in the
  /// relaxation. The same facts give the same number, whatever was evaluated before.
  int64_t Evaluate(std::span<const int> facts) { return Evaluate(facts, {}, {}); }

  /// The same after `action`, where `before` are landmarks of the state before it: those without the action
  /// still are landmarks, and only the remaining costs are cut anew (Pommerening and Helmert, ICAPS 2013).
  int64_t Evaluate(std::span<const int> facts, std::span<const int> before, ActionId action);
  /// Of the last evaluation.
  const Landmarks& landmarks() const { return landmarks_; }

 private:
  int64_t Keep(std::span<const int> before, ActionId action);
  void Explore(std::span<const int> facts);
  void Update(int64_t least);
  void Propagate(int op);
  void Support(int fact, int op);
  void Release(int op);
  void MarkGoalZone();
  void FindCut(std::span<const int> facts);

  struct Range {
    int begin = 0, end = 0;
  };
  enum class Zone : uint8_t { kNone, kGoal, kBefore };

  /// An operator's state during an evaluation.
  struct Operator {
    int64_t cost = 0;            ///< What remains of its payer's.
    int64_t supporter_cost = 0;  ///< Of its most expensive precondition.
    int supporter = -1;          ///< Its most expensive precondition.
    int missing = 0;             ///< Preconditions not reached.
    int next = -1, before = -1;  ///< In the list of those with the same supporter.
  };

  const Relaxation& relaxation_;
  // The relaxation with its lists laid out one after another.
  std::vector<int> payer_;
  std::vector<Range> preconditions_, adds_, users_, adders_, of_payer_;
  std::vector<int> precondition_list_, add_list_, user_list_, adder_list_, of_payer_list_;

  std::vector<Operator> fresh_, operators_;
  std::vector<int64_t> fact_cost_;  ///< h_max.
  std::vector<int> supported_;      ///< Per fact: the first operator that it supports.
  std::vector<Zone> zone_;
  RelaxedQueue queue_;
  std::vector<int> stack_, cut_;
  Landmarks landmarks_;
};

}  // namespace tether::task
