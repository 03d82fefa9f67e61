#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "tether/math/pose.h"

namespace tether::nlp {

/// A point of a program: a value for each block of variables.
struct Point {
  std::vector<math::Pose> poses;         ///< By the index that AddPose returned.
  std::vector<Eigen::VectorXd> vectors;  ///< By the index that AddVector returned.
  /// Poses that are given: residuals may read them, and no solver moves them. So one program serves for many
  /// problems that differ only in given poses.
  std::vector<math::Pose> parameters = {};
};

/// A reference to a block of variables: a pose of SE(3), tangent dimension 6, or a vector.
struct BlockRef {
  enum class Kind { kPose, kVector };
  Kind kind = Kind::kPose;
  int index = 0;  ///< In Point::poses or Point::vectors.
  bool operator==(const BlockRef&) const = default;
};

enum class Unit { kMetre, kRadian, kNone };

using VectorRef = Eigen::Ref<Eigen::VectorXd>;
using JacobianRef = Eigen::Ref<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

/// A vector-valued function of some blocks. One residual serves as cost, equality or inequality.
///
/// Identities that every residual keeps: evaluating changes nothing and depends on nothing but the point;
/// asking for the Jacobian never changes the value; the Jacobian is exact, in right perturbations of poses
/// (see math::Pose) and plain differences of vectors. `blocks()` are distinct. Where the function has a kink
/// (ties in geometry), the Jacobian is that of one of the branches.
class Residual {
 public:
  virtual ~Residual() = default;

  const std::string& name() const { return name_; }  ///< For people: "rests_on(hook, table)".
  int step() const { return step_; }                 ///< The key pose that it is stated at.
  int size() const { return size_; }
  Unit unit() const { return unit_; }  ///< Of every row.
  const std::vector<BlockRef>& blocks() const { return blocks_; }

  /// Writes the `size()` rows to `r`. If `J` is not null, also the Jacobian: size() rows, and for each block
  /// in the order of blocks() its tangent dimension in columns; every entry is written.
  virtual void Evaluate(const Point& x, VectorRef r, JacobianRef* J) const = 0;

 protected:
  Residual(std::string name, int step, int size, Unit unit, std::vector<BlockRef> blocks)
      : name_(std::move(name)), step_(step), size_(size), unit_(unit), blocks_(std::move(blocks)) {}

 private:
  std::string name_;
  int step_;
  int size_;
  Unit unit_;
  std::vector<BlockRef> blocks_;
};

/// A cost adds ‖r‖² to the objective; an equality asks r = 0; an inequality asks r ≤ 0, row by row.
enum class Role { kCost, kEquality, kInequality };

struct Term {
  std::shared_ptr<const Residual> residual;
  Role role;
};

/// minimise Σ ‖r_cost‖² subject to r_eq = 0, r_in ≤ 0. Immutable after it is built; safe to evaluate from
/// many threads.
class Program {
 public:
  /// A pose block. `name` is for messages.
  BlockRef AddPose(std::string name);
  /// A vector block with bounds, each of the block's size; ±infinity where there is none.
  BlockRef AddVector(std::string name, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);
  void Add(std::shared_ptr<const Residual> residual, Role role);

  int num_poses() const { return static_cast<int>(pose_names_.size()); }
  int num_vectors() const { return static_cast<int>(vectors_.size()); }
  const std::vector<Term>& terms() const { return terms_; }
  const std::string& name(BlockRef block) const;
  const Eigen::VectorXd& lower(int vector) const { return vectors_[static_cast<size_t>(vector)].lower; }
  const Eigen::VectorXd& upper(int vector) const { return vectors_[static_cast<size_t>(vector)].upper; }
  /// 6 for a pose, the size of a vector.
  int TangentSize(BlockRef block) const;
  /// Sum of the tangent dimensions of all blocks.
  int num_variables() const;
  /// Total rows of all terms with this role.
  int num_rows(Role role) const;
  /// First tangent coordinate of a block: poses first in the order of their indices, then vectors.
  int Offset(BlockRef block) const;

 private:
  struct VectorBlock {
    std::string name;
    Eigen::VectorXd lower, upper;
  };
  std::vector<std::string> pose_names_;
  std::vector<VectorBlock> vectors_;
  std::vector<Term> terms_;
};

/// The point moved by `delta`, one coordinate per tangent dimension in the order of Program::Offset(): poses
/// by the right perturbation X · Exp(δ), vectors by addition. Bounds are ignored.
Point Retract(const Point& x, const Eigen::VectorXd& delta);

/// Cost and violations at a point, in the program's own units.
struct Assessment {
  double cost = 0;
  double max_violation_m = 0;
  double max_violation_rad = 0;
  double max_violation_other = 0;  ///< Of rows without a unit.
  double max_bound_violation = 0;  ///< Of the bounds of vectors, in the vector's own unit.
  /// One entry per constraint row that is violated by more than 1e-9, largest first.
  struct Violation {
    const Residual* residual;
    int row;
    double amount;  ///< In the residual's unit, > 0.
  };
  std::vector<Violation> violations;
  bool finite = true;      ///< No residual gave NaN or infinity.
  std::string not_finite;  ///< Name of the first residual that did.
};
/// Evaluates cost and violations at `x`, which has a value for every block. Independent of any solver.
Assessment Assess(const Program& program, const Point& x);

/// Compares a residual's Jacobian at `x` with numeric differentiation. Returns the largest absolute
/// difference over max(1, the largest entry). For tests and for checking constraints that users add.
double JacobianError(const Residual& residual, const Program& program, const Point& x, double step = 1e-5);

}  // namespace tether::nlp
