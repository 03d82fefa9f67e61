#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "tether/nlp/native/manifold_view.h"

namespace tether::nlp {

/// The subproblem of a step,
///   minimise over d:  gᵀd + ½ dᵀ(H + λI)d + Σ_rows P(c + J d),
/// where P is ν |·| for equalities and ν max(0, ·) for inequalities. With a multiplier y per row, in [−ν, ν]
/// or [0, ν], it is min_d max_y gᵀd + ½ dᵀ(H + λI)d + yᵀ(c + J d), which always has a solution.
///
/// Only near rows are included; the others are checked in the end, and if the step violates one, it is added
/// and the subproblem is solved again. First a few Newton steps of a proximal method of multipliers, y ←
/// clamp(y + σ (c + J d)), from the rows that were active last: near convergence they are the right ones, and
/// one factorisation is enough. Otherwise a primal–dual interior point with Mehrotra's predictor and
/// corrector. In both, rows condense into a positive definite matrix of the pattern of the program's blocks.
/// Nothing allocates after construction.
class ElasticQp {
 public:
  /// `view` must outlive this.
  explicit ElasticQp(ManifoldView& view);

  /// g, H and J are those of `values`; c is separate. Starts from the multipliers of the last solve. False if
  /// it did not converge within its iterations; d is then the best one found and still a usable step.
  bool Solve(const ManifoldView::Values& values, const Eigen::VectorXd& c, double nu, double lambda,
             double tolerance);

  /// Begins the next solve with these multipliers, one per row of the program.
  void StartFrom(const Eigen::VectorXd& y);
  /// Called now and then within a solve; when it returns true, the solve ends.
  void SetStop(std::function<bool()> stop) { stop_ = std::move(stop); }

  const Eigen::VectorXd& d() const { return d_; }
  /// Of the rows of the program.
  auto y() const { return y_.head(view_.num_rows()); }

  /// Cuts: further linearisations of inequality rows that have kinks, each a row of its own beside the first
  /// one. A cut is added from `there`, the values at the step d, for each row well above its prediction
  /// `model`. Returns how many were added; the oldest are replaced.
  int AddCuts(const ManifoldView::Values& there, const Eigen::VectorXd& d, const Eigen::VectorXd& model);
  /// Whether this row has a cut from the present point.
  bool HasFreshCut(int row) const;
  /// Raises `rows`, predicted for the step d, to the predictions of the cuts where these are larger.
  void RaiseToCuts(const Eigen::VectorXd& d, Eigen::VectorXd& rows) const;
  /// The point has moved by d: the cuts move along, and those of the point before the last are dropped.
  void MoveCuts(const Eigen::VectorXd& d);
  /// Drops the cuts that were not added at the present point; false if there were none.
  bool DropOldCuts();
  /// Factorisations since construction, and those of them in the interior point.
  int factorizations() const { return factorizations_; }
  int interior_factorizations() const { return interior_factorizations_; }
  /// Seconds spent putting matrices together.
  double assembly_s() const { return assembly_s_; }

  /// Writes J d.
  void Multiply(const ManifoldView::Values& values, const Eigen::VectorXd& d, Eigen::VectorXd& Jd) const;
  /// Writes H d.
  void MultiplyCurvature(const ManifoldView::Values& values, const Eigen::VectorXd& d,
                         Eigen::VectorXd& Hd) const;

 private:
  /// Whether to try what may fail: after a failure it is passed over once, after each further one in a row
  /// twice as often.
  class Patience {
   public:
    bool TriesNow() { return wait_ == 0 || --wait_ == 0; }
    void Note(bool succeeded) {
      failures_ = succeeded ? 0 : failures_ + 1;
      if (!succeeded) wait_ = 1 + (1 << std::min(failures_ - 1, kLongestWait));
    }

   private:
    static constexpr int kLongestWait = 3;  // 2^3
    int failures_ = 0, wait_ = 0;
  };

  void SetRows(const Eigen::VectorXd& c, double nu);
  void ChooseNearRows();
  /// Includes the rows that d violates and that are not included yet; false if there were none.
  bool AddViolatedRows(const ManifoldView::Values& values);
  const double* RowOf(const ManifoldView::Values& values, int row) const;
  double DotRow(const ManifoldView::Values& values, int row, const Eigen::VectorXd& d) const;
  void AddRow(const ManifoldView::Values& values, int row, double factor, Eigen::VectorXd& out) const;
  /// Factorises H + λI + Σ wᵢ gᵢ gᵢᵀ over the near rows, with `weight_` by their places in near_.
  void Factorize(const ManifoldView::Values& values, double lambda);
  void Assemble(const ManifoldView::Values& values, double lambda);

  bool SolveByActiveSet(const ManifoldView::Values& values, double lambda, double tolerance);
  /// Writes the gradient of the proximal function, with multipliers by `active_` (guessed) or as they are.
  void Slope(const ManifoldView::Values& values, double lambda, bool guessed);
  void FactorizeActive(const ManifoldView::Values& values, double lambda);

  /// Starts from the central path, or (`resume`) where it last ended. Leaves its guess of the active rows in
  /// `active_`. Carefully: without Mehrotra's corrector, slower and surer.
  bool SolveByInteriorPoint(const ManifoldView::Values& values, double lambda, double tolerance, bool resume,
                            bool careful = false);
  /// The Newton step towards complementarity products `target_a_` and `target_b_`.
  void Direction(const ManifoldView::Values& values);
  double LongestStep() const;
  /// The sum of the complementarity products after a step of this length along the direction.
  double SumOfProducts(double step) const;

  struct Cut {
    const ManifoldView::Group* group = nullptr;  // null: not in use
    int row = 0;
    double value = 0;  // at d = 0
    int age = 0;       // in accepted steps
  };

  static constexpr int kMostCuts = 24;

  double Along(size_t cut, const Eigen::VectorXd& d) const;

  ManifoldView& view_;
  std::array<Cut, kMostCuts> cuts_;
  size_t next_cut_ = 0;
  size_t widest_ = 6;
  std::vector<double> cut_jacobians_;  // widest_ entries each
  int factorizations_ = 0;
  int interior_factorizations_ = 0;
  double assembly_s_ = 0;
  std::function<bool()> stop_ = [] { return false; };
  double largest_change_;  // of a row in the last step

  // By row, the cuts' behind the program's.
  Eigen::VectorXd c_, y_, lo_, hi_;
  std::vector<const ManifoldView::Group*> group_of_;
  std::vector<char> is_near_, active_, factored_;
  std::vector<int> near_;
  bool guess_known_ = false;
  // Of the active set from the rows that a rough interior point found: where rows are redundant, it fails
  // again and again.
  Patience with_rough_rows_;

  Eigen::VectorXd d_, dd_, Hd_, slope_, Hstep_, interior_d_;
  double sigma_ = 0, factored_sigma_ = 0, factored_lambda_ = 0;
  long factored_revision_ = -1;
  std::vector<const double*> gram_rows_;
  std::vector<double> gram_weights_;

  // By place in near_. Of each row: c + J d = a − b with a, b > 0; a (hi − y) and b (y − lo) go to zero.
  Eigen::VectorXd z_, shifted_, Jstep_, weight_;
  Eigen::VectorXd multiplier_, interior_y_, interior_z_, a_, b_, u_, l_, dy_, da_, db_, primal_, target_a_,
      target_b_, wanted_;
};

}  // namespace tether::nlp
