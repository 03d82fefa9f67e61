#pragma once

#include <cstdint>
#include <vector>

#include "tether/task/product.h"

namespace tether::task {

/// A product without deletion, for heuristics: facts only ever become true. Facts are atoms, negated atoms
/// (as far as something asks for them), states of the automaton's parts, and auxiliary ones for disjunctions.
///
/// An action becomes one operator, and one more for each conditional effect; they share the action, whose
/// cost is paid once. Axioms, disjunctions and the transitions of the automaton's parts become operators
/// without cost. Negated derived atoms count as true, and so do parts that have no automaton: both only relax
/// more. What can't contribute to the goal is left out.
class Relaxation {
 public:
  struct Operator {
    int action = -1;                 ///< Index into costs(); the last one costs nothing.
    std::vector<int> preconditions;  ///< At least one; each once.
    std::vector<int> adds;           ///< Each once.
  };

  /// `product` must outlive the relaxation. With `unit_costs` each action costs 1.
  explicit Relaxation(const Product& product, bool unit_costs = false);

  int facts() const { return facts_; }
  int goal() const { return goal_; }
  const std::vector<Operator>& operators() const { return operators_; }
  /// Per action, and 0 at the end for operators that are no action.
  const std::vector<int64_t>& costs() const { return costs_; }
  /// The facts that hold in a state of the product; `facts` is overwritten.
  void FindFacts(symbolic::StateView state, std::vector<int>& facts) const;

 private:
  static constexpr int kTrue = 0;  ///< The fact that always holds.

  void NoteNegated(const symbolic::GroundFormula& formula);
  int AddFact() { return facts_++; }
  void AddOperator(int action, std::vector<int> preconditions, std::vector<int> adds);
  /// Adds what `formula` asks for to `preconditions`; false if it can't hold.
  bool Require(const symbolic::GroundFormula& formula, std::vector<int>& preconditions);
  /// The same for a literal over the formula's propositions.
  bool RequireProposition(int proposition, bool positive, std::vector<int>& preconditions);
  void AddActions();
  void AddAutomaton();
  void KeepRelevant();

  const Product& product_;
  int free_ = 0;  ///< The last index of costs().
  int facts_ = 0;
  int goal_ = 0;
  std::vector<Operator> operators_;
  std::vector<int64_t> costs_;
  std::vector<int> positive_, negative_;      ///< Facts by atom, -1 if nobody asks.
  std::vector<bool> is_negated_;              ///< By atom.
  std::vector<std::vector<int>> part_facts_;  ///< By part and its state; empty if it has no automaton.
};

}  // namespace tether::task
