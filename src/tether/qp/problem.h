#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

namespace tether::qp {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// The most variables a problem can have.
inline constexpr int kMaxVariables = 24;

/// Eight numbers on one cache line: a kernel's unit of work.
struct alignas(64) CacheLine {
  double entries[8];
};

/// A dense, strictly convex quadratic program,
///   minimise over x in ℝⁿ: ½ xᵀHx + gᵀx  subject to  E x = e,  lower ≤ A x ≤ upper,  x_lower ≤ x ≤ x_upper.
/// Sides may be infinite. Rows are two-sided because both sides share the product A x, which is the cost of a
/// row; A is stored by columns, so that this product needs no sums across lanes. Bounds cost no product at
/// all: prefer them to rows of A.
///
/// A view writes in place; nothing allocates after construction.
class Problem {
 public:
  using Matrix = Eigen::Map<Eigen::MatrixXd, Eigen::Aligned64, Eigen::OuterStride<>>;
  using ConstMatrix = Eigen::Map<const Eigen::MatrixXd, Eigen::Aligned64, Eigen::OuterStride<>>;
  using RowMatrix = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>,
                               Eigen::Aligned64, Eigen::OuterStride<>>;
  using ConstRowMatrix =
      Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>,
                 Eigen::Aligned64, Eigen::OuterStride<>>;
  using Vector = Eigen::Map<Eigen::VectorXd, Eigen::Aligned64>;
  using ConstVector = Eigen::Map<const Eigen::VectorXd, Eigen::Aligned64>;

  /// Room for the given sizes, all in use at first. 1 ≤ max_variables ≤ kMaxVariables.
  Problem(int max_variables, int max_equalities, int max_inequalities);

  /// Sets other sizes, at most the maximal ones, and clears: zeros, and all sides infinite.
  void Resize(int variables, int equalities, int inequalities);

  int num_variables() const { return n_; }
  int num_equalities() const { return num_equalities_; }
  int num_inequalities() const { return m_; }

  /// n × n, symmetric positive definite; both triangles are read.
  Matrix H() { return {at(H_), n_, n_, Eigen::OuterStride<>(stride_)}; }
  ConstMatrix H() const { return {at(H_), n_, n_, Eigen::OuterStride<>(stride_)}; }
  Vector g() { return {at(g_), n_}; }
  ConstVector g() const { return {at(g_), n_}; }
  /// One row per equality.
  RowMatrix E() { return {at(E_), num_equalities_, n_, Eigen::OuterStride<>(stride_)}; }
  ConstRowMatrix E() const { return {at(E_), num_equalities_, n_, Eigen::OuterStride<>(stride_)}; }
  Vector e() { return {at(e_), num_equalities_}; }
  ConstVector e() const { return {at(e_), num_equalities_}; }
  /// One row per inequality; lower = upper is allowed, but E is faster.
  Matrix A() { return {at(A_), m_, n_, Eigen::OuterStride<>(padded_m_)}; }
  ConstMatrix A() const { return {at(A_), m_, n_, Eigen::OuterStride<>(padded_m_)}; }
  Vector lower() { return {at(lower_), m_}; }
  ConstVector lower() const { return {at(lower_), m_}; }
  Vector upper() { return {at(upper_), m_}; }
  ConstVector upper() const { return {at(upper_), m_}; }
  Vector x_lower() { return {at(x_lower_), n_}; }
  ConstVector x_lower() const { return {at(x_lower_), n_}; }
  Vector x_upper() { return {at(x_upper_), n_}; }
  ConstVector x_upper() const { return {at(x_upper_), n_}; }

  /// Entries from one variable's column of H, and one equality's row of E, to the next.
  int stride() const { return stride_; }
  /// Entries from one column of A to the next; the rows beyond m are zero and unlimited.
  int padded_rows() const { return padded_m_; }

 private:
  double* at(Eigen::Index offset) { return reinterpret_cast<double*>(memory_.data()) + offset; }
  const double* at(Eigen::Index offset) const {
    return reinterpret_cast<const double*>(memory_.data()) + offset;
  }

  int max_n_, max_equalities_, max_m_;
  int n_ = 0, num_equalities_ = 0, m_ = 0, stride_ = 8, padded_m_ = 0;
  std::vector<CacheLine> memory_;
  Eigen::Index H_ = 0, g_ = 0, E_ = 0, e_ = 0, A_ = 0, lower_ = 0, upper_ = 0, x_lower_ = 0, x_upper_ = 0;
};

}  // namespace tether::qp
