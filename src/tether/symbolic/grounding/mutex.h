#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tether/symbolic/grounding/task.h"

namespace tether::symbolic {

/// A literal over a task's atoms as a number: 2 · atom, plus 1 if negated.
inline int Literal(int atom, bool positive) { return 2 * atom + (positive ? 0 : 1); }

/// The literals that must hold wherever `condition` does: those outside of disjunctions.
std::vector<int> NecessaryLiterals(const Condition& condition);

/// Per atom another one: a permutation that maps a task's actions onto one another.
using AtomPermutation = std::vector<int>;

/// Pairs of literals that hold together in no state that is reachable from the start, or from an image of the
/// start under permutations: those that h² excludes (Haslum and Geffner, AIPS 2000; Alcázar and Torralba,
/// ICAPS 2015). Sound, not complete. Nothing is known of derived atoms.
class Mutexes {
 public:
  /// None if it would take more than `max_work` operations on words. `permutations` and all that follow one
  /// another are applied to the start.
  static std::optional<Mutexes> Find(const Task& task, const std::vector<AtomPermutation>& permutations = {},
                                     size_t max_work = 50'000'000);

  /// A literal is a mutex with itself if no such state has it.
  bool AreMutex(int a, int b) const {
    const auto i = static_cast<size_t>(a), j = static_cast<size_t>(b);
    return (together_[i * words_ + j / 64] >> (j % 64) & 1) == 0;
  }

 private:
  friend class MutexFinder;
  size_t words_ = 0;
  std::vector<uint64_t> together_;  ///< Per literal a row: with which others it may hold.
};

/// Atoms of which at most one holds in any state that the mutexes are about.
struct Variable {
  std::vector<int> atoms;
  bool exactly_one = false;  ///< One of them always holds.
};

/// Finds variables greedily, from each atom on, first with atoms about one of its arguments: maximal sets,
/// each once; an atom may be in several. `permutations` are those of the mutexes.
std::vector<Variable> FindVariables(const Task& task, const Mutexes& mutexes,
                                    const std::vector<AtomPermutation>& permutations = {});

}  // namespace tether::symbolic
