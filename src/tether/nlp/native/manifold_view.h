#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "tether/nlp/native/block_cholesky.h"
#include "tether/nlp/program.h"
#include "tether/nlp/solver.h"

namespace tether::nlp {

/// A program as the native solver sees it: rows c(x) with multipliers, the cost's Gauss–Newton model, and
/// steps on the manifold. The variables are nodes of six coordinates: a pose is one node, a vector as many as
/// needed, the last one padded. Nodes are in an order of elimination with little fill.
///
/// This is the workspace of one solve: not to be shared between threads. Nothing allocates after
/// construction, except residuals themselves.
class ManifoldView {
 public:
  /// Rows that depend on the same nodes, one dense matrix.
  struct Group {
    std::vector<int> nodes;  ///< Positions, ascending; six columns each.
    std::vector<int> slots;  ///< Of the products of pairs (p, q ≤ p) of nodes, p by p.
    int first_row = 0;
    int rows = 0;
    size_t first_value = 0;  ///< Of the row-major rows × 6·nodes matrix in Values::jacobian.
    int columns() const { return 6 * static_cast<int>(nodes.size()); }
  };

  /// The values and derivatives at a point.
  struct Values {
    long revision = -1;  ///< Another one for each evaluation of the view.
    double cost = 0;
    Eigen::VectorXd gradient;         ///< Of the cost, per coordinate.
    Eigen::VectorXd rows;             ///< Of all constraints: equalities = 0, inequalities and bounds ≤ 0.
    std::vector<double> jacobian;     ///< Of the rows, by groups.
    BlockCholesky::Blocks curvature;  ///< 2 JᵀJ of the cost, by the factor's slots.
  };

  /// `program` must outlive the view.
  explicit ManifoldView(const Program& program);

  int num_coordinates() const { return 6 * num_nodes_; }
  int num_rows() const { return static_cast<int>(is_equality_.size()); }
  bool is_equality(int row) const { return is_equality_[row] != 0; }
  const std::vector<Group>& groups() const { return groups_; }
  /// The slots that `curvature` fills.
  const std::vector<int>& curvature_slots() const { return curvature_slots_; }
  BlockCholesky& factor() { return factor_; }

  /// The guess with rotations made orthogonal and vectors moved into their bounds.
  Point Start(const Point& guess) const;
  Values MakeValues() const;
  /// False if some residual is not finite; see not_finite().
  bool Evaluate(const Point& x, Values& values);
  /// Of the last evaluation; empty if all were finite.
  const std::string& not_finite() const { return not_finite_; }
  int evaluations() const { return evaluations_; }
  /// Writes x moved by `scale` · d to `moved`, which has the blocks of x.
  void Move(const Point& x, const Eigen::VectorXd& d, double scale, Point& moved) const;
  /// The largest turn of a pose in the step d, in radians.
  double LargestTurn(const Eigen::VectorXd& d) const;
  /// Largest violation of the rows with this unit; bounds count as kNone.
  double Violation(const Eigen::VectorXd& rows, Unit unit) const;
  double Violation(const Eigen::VectorXd& rows) const;
  /// Σ |violation| over all rows.
  double TotalViolation(const Eigen::VectorXd& rows) const;

  /// Multipliers by rows as those of the program's terms, and back; entries that `warm` lacks become zero.
  void WriteMultipliers(const Eigen::VectorXd& y, WarmStart& warm) const;
  Eigen::VectorXd ReadMultipliers(const WarmStart& warm) const;
  /// The terms of the rows with a weight above `least`, those with the largest sums first.
  std::vector<int> TermsByWeight(const Eigen::VectorXd& weights, double least) const;

  /// Adds Σ wᵢ gᵢ gᵢᵀ over rows of the form of a group to `target`, by slots.
  static void AddGram(const Group& group, const std::vector<const double*>& rows, const double* weights,
                      BlockCholesky::Blocks& target);

 private:
  struct TermPlan {
    const Residual* residual;
    Role role;
    int group;      // of groups_, or of cost_groups_
    int first_row;  // in Values::rows; unused for costs
    int first_row_in_group;
    std::vector<int> columns;  // of the group, for each column of the residual; −1: fixed by its bounds
  };
  struct Bound {
    int vector, entry;
    double sign;  // +1: an upper bound, −1: a lower one
    int row;
  };

  std::vector<int> NodesOf(const Residual& residual) const;
  void PlanTerms();
  void PlanBounds();
  double Amount(const Eigen::VectorXd& rows, int row) const;

  const Program& program_;
  int num_nodes_ = 0;
  std::vector<int> first_node_;  // of each vector, before ordering
  std::vector<int> positions_;
  BlockCholesky factor_{0, {}};
  std::vector<Group> groups_, cost_groups_;
  std::vector<TermPlan> terms_;
  std::vector<Bound> bounds_;
  std::vector<char> is_equality_;
  std::vector<Unit> units_;
  std::vector<int> curvature_slots_;
  size_t num_values_ = 0;

  Eigen::VectorXd residual_scratch_;
  Eigen::MatrixXd jacobian_scratch_;
  std::vector<double> row_scratch_, twos_;
  std::vector<const double*> cost_rows_;
  std::string not_finite_;
  int evaluations_ = 0;
};

}  // namespace tether::nlp
