#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "tether/nlp/program.h"

namespace tether::nlp {

/// The chart of SE(3) around `origin`: v = (position, axis-angle) ↦ (p₀ + v_p, R₀ · Exp(v_r)). v = 0 is the
/// origin. Regular for ‖v_r‖ < 2π.
math::Pose ChartPose(const math::Pose& origin, const math::Vector6d& v);

/// The Jacobian of ChartPose: a change dv of the coordinates moves the pose by the right perturbation
/// δ = (R(v)ᵀ dv_p, J_r(v_r) dv_r).
math::Matrix6d ChartJacobian(const math::Pose& origin, const math::Vector6d& v);

/// A program as functions of a plain vector, for backends that need that form (docs/architecture.md,
/// "Conventions"). Poses are charted around the point it is made with; vectors are themselves. Constraint
/// rows: equalities first, then inequalities, each in the order of the program's terms.
///
/// This is the workspace of one solve: not to be shared between threads. Values are computed once per point.
/// Functions are virtual for backends that are plugins (common/plugin.h), which link nothing of this room.
class VectorView {
 public:
  struct Entry {
    int row;
    int column;
  };

  /// `program` must outlive the view. `origin` has a value for every block.
  VectorView(const Program& program, const Point& origin);
  virtual ~VectorView() = default;

  int num_variables() const { return num_variables_; }
  int num_equalities() const { return num_equalities_; }
  int num_inequalities() const { return num_inequalities_; }
  int num_constraints() const { return num_equalities_ + num_inequalities_; }
  const Eigen::VectorXd& lower() const { return lower_; }
  const Eigen::VectorXd& upper() const { return upper_; }
  /// The coordinates of the origin; vectors are moved into their bounds.
  const Eigen::VectorXd& start() const { return start_; }
  Point PointAt(const Eigen::VectorXd& x) const;

  /// The places of the constraint Jacobian's values. Fixed, one entry per place.
  const std::vector<Entry>& jacobian_entries() const { return jacobian_entries_; }
  /// The places of the lower triangle of the Gauss–Newton matrix, the whole diagonal included.
  const std::vector<Entry>& hessian_entries() const { return hessian_entries_; }

  /// Computes cost and constraints at x. False if some residual is not finite there; see not_finite().
  virtual bool EvaluateValues(const Eigen::VectorXd& x);
  /// Also the gradient, the constraint Jacobian and the Gauss–Newton matrix.
  virtual bool EvaluateDerivatives(const Eigen::VectorXd& x);

  /// Of the last point evaluated.
  double cost() const { return cost_; }
  const Eigen::VectorXd& constraints() const { return constraints_; }
  const Eigen::VectorXd& gradient() const { return gradient_; }
  const std::vector<double>& jacobian_values() const { return jacobian_values_; }
  /// 2 JᵀJ of the cost residuals: the Hessian of the cost without the residuals' own curvature.
  const std::vector<double>& hessian_values() const { return hessian_values_; }

  /// Largest violation of rows in metres and in radians, at the last point evaluated.
  double ViolationIn(Unit unit) const;
  /// Name of the residual that was not finite; empty if all were.
  const std::string& not_finite() const { return not_finite_; }
  /// How often the whole program was evaluated.
  int evaluations() const { return evaluations_; }

 private:
  struct Span {
    int offset;  ///< First coordinate of the block.
    int size;
    int pose;  ///< Index of the pose, or −1.
  };
  struct BlockProduct {
    int row_block, column_block;  ///< Within the term; the first has the larger offset or is the same.
    int first;                    ///< Of the values in hessian_values_, column by column.
  };
  struct Row {
    const Residual* residual;
    Role role;
    int first_row;    ///< Of the constraints.
    int first_value;  ///< In jacobian_values_.
    std::vector<Span> spans;
    std::vector<BlockProduct> products;
    int columns;
  };

  bool Evaluate(const Eigen::VectorXd& x, bool derivatives);
  void AddHessianEntries();

  const Program& program_;
  Point origin_;
  int num_variables_;
  int num_equalities_;
  int num_inequalities_;
  Eigen::VectorXd lower_, upper_, start_;
  std::vector<Row> rows_;
  std::vector<Entry> jacobian_entries_, hessian_entries_;

  enum class Level { kNothing, kValues, kDerivatives };
  Level level_ = Level::kNothing;
  Eigen::VectorXd x_;
  double cost_ = 0;
  Eigen::VectorXd constraints_, gradient_;
  std::vector<double> jacobian_values_, hessian_values_;
  std::vector<math::Matrix6d> chart_jacobians_;
  std::vector<int> columns_scratch_;
  Eigen::VectorXd residual_scratch_;
  Eigen::MatrixXd jacobian_scratch_, chained_scratch_;
  std::string not_finite_;
  int evaluations_ = 0;
};

}  // namespace tether::nlp
