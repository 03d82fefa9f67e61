#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tether/common/id.h"
#include "tether/symbolic/grounding/mutex.h"
#include "tether/task/goal/product.h"
#include "tether/task/heuristics/merge.h"

namespace tether::task {

/// The delete relaxation of a product, for heuristics: facts only ever become true. Facts are atoms, negated
/// atoms (as far as something asks for them), states of the automaton's parts, and auxiliary ones for
/// disjunctions.
///
/// An action becomes one operator, and one more for each conditional effect; they share a payer, so that the
/// action's cost counts once. With a merge, an action that is about both variables or changes one of them
/// becomes a payer for each pair of values at which it may be applicable; with tracking, one that changes a
/// tracked variable for each state of the part. Axioms, disjunctions and the transitions of the automaton's
/// parts become operators without cost. Negated derived atoms count as true, and so do parts that have no
/// automaton: both only relax further. What can't contribute to the goal is left out.
class Relaxation {
 public:
  struct Operator {
    int payer = -1;                  ///< The last one costs nothing.
    std::vector<int> preconditions;  ///< At least one; each once.
    std::vector<int> adds;           ///< Each once.
  };

  /// What pays for operators: an action, from a pair of a merge's values to another, -1 where there is none.
  struct Payer {
    ActionId action;
    int from = -1, to = -1;
  };

  /// `product` must outlive the relaxation. With `unit_costs` each action costs 1.
  explicit Relaxation(const Product& product, bool unit_costs = false);
  /// `mutexes` must outlive it too. At most one tracking per part.
  Relaxation(const Product& product, bool unit_costs, std::optional<Merge> merge,
             std::vector<Tracking> trackings, const symbolic::Mutexes& mutexes);

  int facts() const { return facts_; }
  int goal() const { return goal_; }
  const std::vector<Operator>& operators() const { return operators_; }
  /// Without the last one, which is for operators that are no action. Without merge and
  /// tracking these are the actions.
  const std::vector<Payer>& payers() const { return payers_; }
  /// Per payer, and 0 at the end.
  const std::vector<int64_t>& costs() const { return costs_; }
  const Merge* merge() const { return merge_ ? &*merge_ : nullptr; }
  /// No reachable state has this pair of the merge's values.
  bool IsImpossible(size_t pair) const { return possible_[pair] == 0; }
  /// The facts that hold in a state of the product; `facts` is overwritten.
  void FindFacts(symbolic::StateView state, std::vector<int>& facts) const;

 private:
  static constexpr int kTrue = 0;  ///< The fact that always holds.
  static constexpr int kFree =
      -1;  ///< Placeholder for the payer of operators without cost, until all payers are known.

  /// An action at certain values of merge and trackings: what it needs and makes true there.
  struct Context {
    Payer payer;
    std::vector<int> needed, made;  ///< Facts; `made` are those of pairs.
    std::vector<int> literals;      ///< That hold before.
  };

  void Build(bool unit_costs);
  void AddPairs();
  void NoteNegated(const symbolic::GroundFormula& formula);
  int AddFact() { return facts_++; }
  void AddOperator(int payer, std::vector<int> preconditions, std::vector<int> adds);
  /// Adds what `formula` asks for to `preconditions`; false if it can't hold.
  bool Require(const symbolic::GroundFormula& formula, std::vector<int>& preconditions);
  /// The same for a literal over the formula's propositions.
  bool RequireProposition(int proposition, bool positive, std::vector<int>& preconditions);
  void AddActions();
  void AddAction(const Context& context);
  void DropFacts(const symbolic::Variable& variable, std::vector<int>& facts) const;
  void SplitByMerge(std::vector<Context>& contexts) const;
  void SplitByTracking(size_t index, std::vector<Context>& contexts) const;
  void AddAxioms();
  void AddAutomaton();
  int AddTracked(const Tracking& tracking, const std::vector<int>& facts);
  void KeepRelevant();

  const Product& product_;
  std::optional<Merge> merge_;
  std::vector<Tracking> trackings_;
  const symbolic::Mutexes* mutexes_ = nullptr;
  std::vector<char> possible_;                   ///< By pair.
  std::vector<int> merged_facts_;                ///< By pair.
  std::vector<std::vector<int>> tracked_facts_;  ///< By tracking and entry.
  std::vector<Payer> payers_;
  int facts_ = 0;
  int goal_ = 0;
  std::vector<Operator> operators_;
  std::vector<int64_t> costs_;
  std::vector<int> positive_, negative_;      ///< Facts by atom, -1 if nobody asks.
  std::vector<bool> is_negated_;              ///< By atom.
  std::vector<std::vector<int>> part_facts_;  ///< By part and its state; empty if it has no automaton.
};

}  // namespace tether::task
