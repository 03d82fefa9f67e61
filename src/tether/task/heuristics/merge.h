#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "tether/symbolic/grounding/mutex.h"
#include "tether/task/goal/product.h"

namespace tether::task {

/// A variable's values are its atoms, in their order, and after them, unless one always holds, none of them.
inline size_t CountValues(const symbolic::Variable& variable) {
  return variable.atoms.size() + (variable.exactly_one ? 0 : 1);
}
size_t FindValue(const symbolic::Variable& variable, symbolic::StateView state);
/// The value after `action`, applied at `value`; none if it is not applicable there. For actions that change
/// the variable always or never.
std::optional<size_t> ValueAfter(const symbolic::Variable& variable, const symbolic::GroundAction& action,
                                 size_t value);
/// Per value, whether it may hold together with `literals`.
std::vector<bool> FindPossible(const symbolic::Variable& variable, const symbolic::Mutexes& mutexes,
                               const std::vector<int>& literals);
/// Appends the literals that hold where the variable has the value.
void AppendLiterals(const symbolic::Variable& variable, size_t value, std::vector<int>& literals);

bool Contains(const std::vector<int>& list, int item);
bool Asks(const symbolic::GroundAction& action, const symbolic::Variable& variable);
bool Changes(const symbolic::GroundEffect& effect, const symbolic::Variable& variable);
bool Changes(const symbolic::GroundAction& action, const symbolic::Variable& variable);

/// The product of two variables of a task, with pairs as values: where the hand is and what it holds. So the
/// relaxation keeps facts about both at once.
struct Merge {
  symbolic::Variable first, second;  ///< Without common atoms. No conditional effect changes them.

  size_t values() const { return CountValues(first) * CountValues(second); }
  size_t Pair(size_t a, size_t b) const { return a * CountValues(second) + b; }
  size_t First(size_t pair) const { return pair / CountValues(second); }
  size_t Second(size_t pair) const { return pair % CountValues(second); }
  size_t Find(symbolic::StateView state) const {
    return Pair(FindValue(first, state), FindValue(second, state));
  }
};

/// The product of a part of the goal's automaton and the variable that it is about, so that the relaxation
/// keeps how often an object must come somewhere. A value that is implied by pairs of a merge is split by
/// these pairs: in the hand, where the hand is.
class Tracking {
 public:
  /// None if the part is not compiled, a conditional effect changes the variable, or its value does not
  /// determine the propositions that the part reads.
  static std::optional<Tracking> Make(const Product& product, int part, const symbolic::Variable& variable,
                                      const std::optional<Merge>& merge, const symbolic::Mutexes& mutexes);

  int part() const { return part_; }
  const symbolic::Variable& variable() const { return variable_; }
  size_t values() const { return base_.size(); }
  /// The variable's own value.
  size_t Base(size_t value) const { return base_[value]; }
  /// What a pair of the merge implies, if anything.
  std::optional<size_t> ImpliedBy(int pair) const;
  bool IsImplied(size_t value) const { return value >= CountValues(variable_); }

  // Entries: a state of the part with a value.
  size_t entries() const { return possible_.size(); }
  size_t Entry(size_t state, size_t value) const { return state * values() + value; }
  size_t Value(size_t entry) const { return entry % values(); }
  size_t State(size_t entry) const { return entry / values(); }
  /// Some transition into this state reads this value.
  bool IsPossible(size_t entry) const { return possible_[entry]; }
  /// The entry after `state` reads `value`; none if the goal is lost there.
  std::optional<size_t> After(size_t state, size_t value) const;
  /// `merge` is the one that it was made with.
  size_t Find(const Product& product, const Merge* merge, symbolic::StateView state) const;

 private:
  int part_ = 0;
  symbolic::Variable variable_;
  std::vector<size_t> base_;  ///< By value: first the variable's own, then those that pairs imply.
  std::vector<int> implied_;  ///< By pair, -1: nothing.
  std::vector<int> next_;     ///< By entry; -1: a trap.
  std::vector<bool> possible_;
};

}  // namespace tether::task
