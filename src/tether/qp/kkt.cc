#include "tether/qp/kkt.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace tether::qp {
namespace {

using Eigen::VectorXd;

struct RowOf {
  VectorXd a;
  double lower, upper;
};

RowOf RowAt(const Problem& problem, RowKind kind, int index) {
  switch (kind) {
    case RowKind::kEquality:
      return {problem.E().row(index), problem.e()[index], problem.e()[index]};
    case RowKind::kInequality:
      return {problem.A().row(index), problem.lower()[index], problem.upper()[index]};
    case RowKind::kBound:
      break;
  }
  return {VectorXd::Unit(problem.num_variables(), index), problem.x_lower()[index], problem.x_upper()[index]};
}

double Ratio(double part, double whole) { return part == 0 ? 0 : part / whole; }

}  // namespace

double KktResidual::largest() const { return std::max({stationarity, primal, complementarity}); }

KktResidual ComputeKktResidual(const Problem& problem, const VectorXd& x, const RowWeights& multipliers) {
  KktResidual residual;
  const Eigen::MatrixXd H = problem.H();
  const VectorXd g = problem.g();
  const VectorXd c = x.cwiseAbs().cwiseMax(H.ldlt().solve(g).cwiseAbs());
  VectorXd rest = H * x + g;
  VectorXd terms = H.cwiseAbs() * x.cwiseAbs() + g.cwiseAbs();
  for (const RowWeight& row : multipliers) {
    const RowOf of = RowAt(problem, row.kind, row.index);
    rest -= row.weight * of.a;
    terms += std::abs(row.weight) * of.a.cwiseAbs();
    if (row.weight == 0) continue;
    const double side = row.weight > 0 ? of.lower : of.upper;
    residual.complementarity = std::max(
        residual.complementarity,
        std::isfinite(side) ? Ratio(std::abs(of.a.dot(x) - side), of.a.cwiseAbs().dot(c) + std::abs(side))
                            : kInfinity);
  }
  for (Eigen::Index i = 0; i < rest.size(); ++i) {
    residual.stationarity = std::max(residual.stationarity, Ratio(std::abs(rest[i]), terms[i]));
  }
  const auto look = [&](RowKind kind, int count) {
    for (int i = 0; i < count; ++i) {
      const RowOf row = RowAt(problem, kind, i);
      const double value = row.a.dot(x), length = row.a.cwiseAbs().dot(c);
      for (const auto& [over, side] :
           {std::pair(row.lower - value, row.lower), std::pair(value - row.upper, row.upper)}) {
        if (over > 0) residual.primal = std::max(residual.primal, over / (length + std::abs(side)));
      }
    }
  };
  look(RowKind::kEquality, problem.num_equalities());
  look(RowKind::kInequality, problem.num_inequalities());
  look(RowKind::kBound, problem.num_variables());
  return residual;
}

double FarkasCheck::radius() const {
  if (!(gap > 0)) return 0;
  return residual == 0 ? kInfinity : gap / residual;
}

FarkasCheck CheckFarkas(const Problem& problem, const RowWeights& weights) {
  FarkasCheck check;
  VectorXd sum = VectorXd::Zero(problem.num_variables());
  for (const RowWeight& row : weights) {
    const RowOf of = RowAt(problem, row.kind, row.index);
    sum += row.weight * of.a;
    if (row.weight != 0) check.gap += row.weight * (row.weight > 0 ? of.lower : of.upper);
  }
  check.residual = sum.cwiseAbs().maxCoeff();
  return check;
}

}  // namespace tether::qp
