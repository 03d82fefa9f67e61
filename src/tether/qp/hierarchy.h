#pragma once

#include <span>
#include <vector>

#include "tether/qp/solver.h"

namespace tether::qp {

/// Solves problems whose inequality rows may conflict, by priority. Level 0 rows, bounds and equalities
/// always hold. Every other row belongs to a level; the smaller its number, the higher its priority. Level by
/// level, the violations v_i ≥ 0 in lower − v ≤ A x ≤ upper + v are minimised while all levels before keep
/// theirs: first the largest of the level, then the largest of those that can be smaller, and so on (the
/// lexicographic min-max), so that rows outside a conflict hold exactly. Among the points with these
/// violations, x minimises the cost. Scale rows of one level to one unit: their violations are compared.
///
/// The minimal violation is exact, not a penalty: if the rows conflict at violation t, Farkas' lemma gives
/// weights y ≥ 0 that force Σ y_i v_i ≥ gap, thus a larger t ≥ gap / Σ y_i; the t at which no conflict is
/// left is both possible and necessary. Exact means up to rounding, 1e-11 of a row's terms at most. Without
/// conflict it costs as much as Solver. Does not allocate.
class HierarchySolver {
 public:
  HierarchySolver(int max_variables, int max_equalities, int max_inequalities,
                  const SolverOptions& options = {});

  /// `levels` has one entry ≥ 0 per inequality row. kInfeasible only where equalities, bounds and level 0
  /// conflict; solver().conflict() is then the proof. kIterationLimit after `max_solves`.
  Status Solve(const Problem& problem, std::span<const int> levels, Start start = Start::kWarm);

  /// The same for a problem that is known to be in conflict, by a proof without rows of levels after
  /// `last_level`.
  Status SolveConflict(const Problem& problem, std::span<const int> levels, int last_level);

  Status status() const { return status_; }
  auto x() const { return solver_.x(); }
  /// v_i of each inequality row; all zero if no row was relaxed.
  std::span<const double> violations() const { return {violations_.data(), violations_.size()}; }
  /// The number of rows that were relaxed.
  int num_relaxed() const { return num_relaxed_; }
  /// Solves of the underlying problem; 1 if no row was relaxed.
  int solves() const { return solves_; }
  /// Iterations of all of these together.
  int iterations() const { return iterations_; }
  /// Multipliers and, if infeasible, the proof.
  const Solver& solver() const { return solver_; }

 private:
  enum class Row : unsigned char { kAside, kFree, kFrozen };

  void Begin(const Problem& problem, std::span<const int> levels);
  Status Relax(int level);
  Status Relaxed(Start start);
  Status MinimizeLevel(int level);
  void SetSides(int row);
  /// The greatest level of its rows; 0: all of them must hold.
  int LastLevel(const RowWeights& proof) const;
  double SideOf(const RowWeight& row) const;
  bool IsSoft(const RowWeight& row) const;

  Solver solver_;
  const Problem* problem_ = nullptr;
  std::span<const int> levels_;
  std::vector<CacheLine> memory_;
  double *lower_ = nullptr, *upper_ = nullptr;  // sides with violations
  std::vector<double> all_violations_;
  std::span<double> violations_;
  std::vector<Row> state_;
  Status status_ = Status::kNotSolved;
  int max_solves_ = 0;
  int num_relaxed_ = 0, solves_ = 0, iterations_ = 0;
};

}  // namespace tether::qp
