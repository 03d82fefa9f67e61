#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tether/symbolic/mutex.h"
#include "tether/task/product.h"

namespace tether::task {

/// Two variables of a task taken as one whose values are pairs: where the hand is and what it holds. What is
/// true of both at once is then not forgotten when nothing is deleted.
struct Merge {
  symbolic::Variable first, second;  ///< Without common atoms.

  /// A variable's values are its atoms and, unless one always holds, none of them.
  size_t first_values() const { return first.atoms.size() + (first.exactly_one ? 0 : 1); }
  size_t second_values() const { return second.atoms.size() + (second.exactly_one ? 0 : 1); }
  size_t values() const { return first_values() * second_values(); }
  /// The pair that holds in `state`, as first · second_values() + second.
  size_t Find(symbolic::StateView state) const;
};

/// A product without deletion, for heuristics: facts only ever become true. Facts are atoms, negated atoms
/// (as far as something asks for them), states of the automaton's parts, and auxiliary ones for disjunctions.
///
/// An action becomes one operator, and one more for each conditional effect; they share a payer, so that the
/// action's cost is paid once. With a merge, an action that is about both variables or changes one of them
/// becomes such a payer for each pair of values that it may be taken from. Axioms, disjunctions and the
/// transitions of the automaton's parts become operators without cost. Negated derived atoms count as true,
/// and so do parts that have no automaton: both only relax more. What can't contribute to the goal is left
/// out.
class Relaxation {
 public:
  struct Operator {
    int payer = -1;                  ///< The last one costs nothing.
    std::vector<int> preconditions;  ///< At least one; each once.
    std::vector<int> adds;           ///< Each once.
  };

  /// What pays for operators: an action, from a pair of a merge's values to another, -1 where there is none.
  struct Payer {
    int action = -1;
    int from = -1, to = -1;
  };

  /// `product` must outlive the relaxation. With `unit_costs` each action costs 1.
  explicit Relaxation(const Product& product, bool unit_costs = false);
  /// No conditional effect may change the variables of `merge`.
  Relaxation(const Product& product, bool unit_costs, const Merge& merge, const symbolic::Mutexes& mutexes);

  int facts() const { return facts_; }
  int goal() const { return goal_; }
  const std::vector<Operator>& operators() const { return operators_; }
  /// Without the last one, which is for operators that are no action. Without a merge these are the actions.
  const std::vector<Payer>& payers() const { return payers_; }
  /// Per payer, and 0 at the end.
  const std::vector<int64_t>& costs() const { return costs_; }
  const Merge* merge() const { return merge_ ? &*merge_ : nullptr; }
  /// No reachable state has this pair of the merge's values.
  bool IsImpossible(size_t pair) const { return possible_[pair] == 0; }
  /// The facts that hold in a state of the product; `facts` is overwritten.
  void FindFacts(symbolic::StateView state, std::vector<int>& facts) const;

 private:
  static constexpr int kTrue = 0;   ///< The fact that always holds.
  static constexpr int kFree = -1;  ///< The payer of what costs nothing, while others are still added.

  void Build(bool unit_costs);
  void NoteNegated(const symbolic::GroundFormula& formula);
  int AddFact() { return facts_++; }
  void AddOperator(int payer, std::vector<int> preconditions, std::vector<int> adds);
  /// Adds what `formula` asks for to `preconditions`; false if it can't hold.
  bool Require(const symbolic::GroundFormula& formula, std::vector<int>& preconditions);
  /// The same for a literal over the formula's propositions.
  bool RequireProposition(int proposition, bool positive, std::vector<int>& preconditions);
  void AddActions();
  void AddAction(int index, const std::vector<int>& needed, Payer payer);
  bool DependsOnMerge(const symbolic::GroundAction& action) const;
  void AddMerged(int index, const std::vector<int>& needed);
  std::vector<bool> FindPossible(const symbolic::Variable& variable, size_t values,
                                 const std::vector<int>& literals) const;
  void AddAxioms();
  void AddAutomaton();
  void KeepRelevant();

  const Product& product_;
  std::optional<Merge> merge_;
  const symbolic::Mutexes* mutexes_ = nullptr;
  std::vector<char> possible_;     ///< By pair.
  std::vector<int> merged_facts_;  ///< By pair.
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
