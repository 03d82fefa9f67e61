#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "tether/nlp/manifold_view.h"

namespace tether::nlp {

/// The subproblem of a step,
///   minimise over d:  gᵀd + ½ dᵀ(H + λI)d + Σ_rows P(c + J d),
/// where P is ν |·| for equalities and ν max(0, ·) for inequalities. With a multiplier y per row, in [−ν, ν]
/// or [0, ν], it is min_d max_y gᵀd + ½ dᵀ(H + λI)d + yᵀ(c + J d), which always has a solution. Solved by a
/// primal–dual interior point with Mehrotra's predictor and corrector; all rows condense into a positive
/// definite matrix of the pattern of the program's blocks. Nothing allocates after construction.
class ElasticQp {
 public:
  /// `view` must outlive this.
  explicit ElasticQp(ManifoldView& view);

  /// g, H and J are those of `values`; c is separate. Starts from the multipliers of the last solve. False if
  /// it did not converge within its iterations; d is then the best known and still a sensible step.
  bool Solve(const ManifoldView::Values& values, const Eigen::VectorXd& c, double nu, double lambda,
             double tolerance);

  const Eigen::VectorXd& d() const { return d_; }
  /// Of the rows of the program.
  auto y() const { return y_.head(view_.num_rows()); }

  /// Cuts: further linearisations of inequality rows that have kinks, each a row of its own beside the first
  /// one. A cut is taken over from `there`, the values at the step d, for each row that came out well above
  /// `model`, what was predicted of it. Returns how many were added; the oldest give way.
  int AddCuts(const ManifoldView::Values& there, const Eigen::VectorXd& d, const Eigen::VectorXd& model);
  /// Whether this row has a cut from the present point.
  bool HasFreshCut(int row) const;
  /// Where a cut foresees more than `rows` for the step d, puts that in its place.
  void RaiseToCuts(const Eigen::VectorXd& d, Eigen::VectorXd& rows) const;
  /// The point has moved by d: the cuts move along, and those of the point before the last are dropped.
  void MoveCuts(const Eigen::VectorXd& d);
  /// Drops the cuts that were not taken over at the present point; false if there were none.
  bool DropOldCuts();
  /// Iterations since construction.
  int iterations() const { return iterations_; }

  /// Writes J d.
  void Multiply(const ManifoldView::Values& values, const Eigen::VectorXd& d, Eigen::VectorXd& Jd) const;
  /// Writes H d.
  void MultiplyCurvature(const ManifoldView::Values& values, const Eigen::VectorXd& d,
                         Eigen::VectorXd& Hd) const;

 private:
  void AddTransposed(const ManifoldView::Values& values, const Eigen::VectorXd& y, Eigen::VectorXd& out);
  void Factorize(const ManifoldView::Values& values, double lambda);
  /// The Newton step towards complementarity products `target_a_` and `target_b_`.
  void Direction(const ManifoldView::Values& values);
  double LongestStep() const;

  struct Cut {
    const ManifoldView::Group* group = nullptr;  // null: not in use
    int row = 0;
    double value = 0;  // at d = 0
    int age = 0;       // in steps taken
  };

  static constexpr int kMostCuts = 24;

  double Along(size_t cut, const Eigen::VectorXd& d) const;
  void MultiplyAll(const ManifoldView::Values& values, const Eigen::VectorXd& d, Eigen::VectorXd& Jd) const;

  ManifoldView& view_;
  std::array<Cut, kMostCuts> cuts_;
  size_t next_cut_ = 0;
  size_t widest_ = 6;
  std::vector<double> cut_jacobians_;  // widest_ entries each
  int iterations_ = 0;
  Eigen::VectorXd d_, y_;
  // Of each row: c + J d = a − b with a, b > 0; a (hi − y) and b (y − lo) go to zero.
  Eigen::VectorXd lo_, hi_, a_, b_, u_, l_;
  Eigen::VectorXd dd_, dy_, da_, db_, Jd_, Hd_, Jdd_;
  Eigen::VectorXd dual_, primal_, weight_, gram_weight_, target_a_, target_b_, rhs_row_, c_;
  std::vector<double> gram_, column_;
};

}  // namespace tether::nlp
