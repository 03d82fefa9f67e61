#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "tether/qp/active_set.h"
#include "tether/qp/problem.h"
#include "tether/qp/status.h"

namespace tether::qp {

enum class RowKind { kEquality, kInequality, kBound };

std::string ToString(RowKind kind);

/// One constraint with its weight: positive where the lower side is active, negative where the upper one is,
/// of either sign for an equality.
struct RowWeight {
  RowKind kind = RowKind::kInequality;
  int index = 0;  ///< Of the row of E or A, or of the variable.
  double weight = 0;
};

/// A few constraints with weights, without allocation.
class RowWeights {
 public:
  const RowWeight* begin() const { return rows_.data(); }
  const RowWeight* end() const { return rows_.data() + size_; }
  int size() const { return size_; }
  bool empty() const { return size_ == 0; }
  const RowWeight& operator[](int i) const { return rows_[static_cast<size_t>(i)]; }
  void Clear() { size_ = 0; }
  void Add(const RowWeight& row) { rows_[static_cast<size_t>(size_++)] = row; }

 private:
  std::array<RowWeight, kMaxVariables + 1> rows_;
  int size_ = 0;
};

enum class Start {
  kCold,  ///< From the minimiser without constraints.
  kWarm,  ///< From the constraints that were active at the end of the last solve.
};

/// Which instructions a solver may use. All give the same bits; AVX2 is faster.
enum class Instructions { kBest, kBaseline };

struct SolverOptions {
  /// Rows added, and partial steps, per solve; 0: 50 + 5 (variables + rows).
  int max_iterations = 0;
  /// Of a HierarchySolver, solves of the underlying problem; 0: as many as it takes.
  int max_solves = 0;
  Instructions instructions = Instructions::kBest;
};

/// Solves problems up to the sizes given: Goldfarb and Idnani's dual active-set method. Solve() does not
/// allocate, throw or lock, and gives the same bits for the same sequence of calls. Values are read in place.
///
/// What kSolved means is measured by KktResidual() in kkt.h. A constraint that is violated by rounding only
/// (1e-14 of its terms; 4e-13 where it depends on active ones) counts as satisfied.
class Solver {
 public:
  /// Room for problems up to these sizes; allocates here only.
  Solver(int max_variables, int max_equalities, int max_inequalities, const SolverOptions& options = {});
  Solver(const Solver&) = delete;
  Solver& operator=(const Solver&) = delete;

  /// `problem` must be within the sizes given at construction.
  Status Solve(const Problem& problem, Start start = Start::kWarm);
  /// The same with other sides of the inequalities; arrays of problem.padded_rows() entries, each aligned to
  /// 64 bytes, unlimited beyond the last row.
  Status Solve(const Problem& problem, const double* lower, const double* upper, Start start);

  Status status() const { return status_; }
  /// The minimiser if solved; else the last iterate.
  Eigen::Map<const Eigen::VectorXd> x() const { return {frame_.x, frame_.n}; }
  /// The multipliers λ that are not zero by choice: H x + g = Eᵀ λ_E + Aᵀ λ_A + λ_x.
  const RowWeights& active() const { return active_; }
  /// If infeasible, a proof by Farkas' lemma: weights y with Eᵀ y_E + Aᵀ y_A + y_x = 0 (to rounding), so that
  /// 0 = yᵀ(rows of x) ≥ Σ y lower (where y > 0) + Σ y upper (where y < 0) > 0, which can't be. The largest
  /// weight is 1. Else empty.
  const RowWeights& conflict() const { return conflict_; }
  int iterations() const { return frame_.iterations; }
  /// Clears the active constraints, so that the next solve is a cold one.
  void Reset() { active_.Clear(); }

 private:
  RowWeight Row(int position, double weight) const;
  void CollectConflict();

  int max_n_, max_equalities_, max_m_;
  SolverOptions options_;
  Status (*kernel_)(Frame&);
  std::vector<CacheLine> memory_;
  std::array<int, kMaxVariables + 1> position_{}, sign_{}, warm_position_{}, warm_sign_{};
  Frame frame_{};
  Status status_ = Status::kNotSolved;
  RowWeights active_, conflict_;
};

}  // namespace tether::qp
