#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "testing/qp/test_problems.h"

namespace tether::qp::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd RandomVector(Random& random, int n) {
  VectorXd v(n);
  for (double& entry : v) entry = random.Normal();
  return v;
}

MatrixXd RandomMatrix(Random& random, int rows, int columns) {
  MatrixXd matrix(rows, columns);
  for (double& entry : matrix.reshaped()) entry = random.Normal();
  return matrix;
}

double LogUniform(Random& random, double low, double high) { return std::pow(10, random.Uniform(low, high)); }

/// Makes some equalities combinations of others; kBadEqualities: two contradict each other, for which
/// the caller changes the right-hand side.
void MakeEqualitiesDependent(Random& random, Kind kind, Problem& problem) {
  const auto equalities = static_cast<int>(problem.E().rows());
  for (int i = 1; i < equalities; ++i) {
    if (random.Index(2) == 0) problem.E().row(i) = random.Normal() * problem.E().row(random.Index(i));
  }
  if (random.Index(2) == 0 && equalities > 2) {
    problem.E().row(2) = problem.E().row(0) - 2 * problem.E().row(1);
  }
  if (kind == Kind::kBadEqualities) problem.E().row(1) = random.Uniform(0.5, 2) * problem.E().row(0);
}

/// Sides of the rows that `inside` satisfies; kDegenerate: many of them are active there.
void SetSides(Random& random, Kind kind, const VectorXd& inside, Problem& problem) {
  const auto rows = static_cast<int>(problem.A().rows());
  problem.lower() = problem.A() * inside;
  for (int i = 0; i < rows; ++i) {
    const double room = kind == Kind::kDegenerate && random.Index(3) > 0 ? 0 : random.Uniform(0, 1);
    if (random.Index(2) == 0) {
      problem.lower()[i] -= room;
    } else {
      problem.upper()[i] = problem.lower()[i] + room;
      problem.lower()[i] = random.Index(4) == 0 ? problem.lower()[i] - room : -kInfinity;
    }
  }
}

/// Row `to` becomes row `from`, scaled.
void CopyRow(int from, int to, double scale, Problem& problem) {
  problem.A().row(to) = scale * problem.A().row(from);
  problem.lower()[to] = scale > 0 ? scale * problem.lower()[from] : scale * problem.upper()[from];
  problem.upper()[to] = scale > 0 ? scale * problem.upper()[from] : scale * problem.lower()[from];
}

/// Rows that repeat others or follow from them, empty ones, and equalities written as rows.
void MakeDegenerate(Random& random, Problem& problem) {
  const auto rows = static_cast<int>(problem.A().rows()), equalities = static_cast<int>(problem.E().rows());
  for (int i = 2; i < rows; ++i) {
    const int choice = random.Index(6);
    if (choice == 0) CopyRow(random.Index(i), i, 1, problem);
    if (choice == 1) CopyRow(random.Index(i), i, random.Normal(), problem);
    if (choice == 2) {  // the sum of two rows: implied by them
      const int a = random.Index(i), b = random.Index(i);
      problem.A().row(i) = problem.A().row(a) + problem.A().row(b);
      problem.lower()[i] = problem.lower()[a] + problem.lower()[b];
      problem.upper()[i] = problem.upper()[a] + problem.upper()[b];
    }
    if (choice == 3) problem.A().row(i).setZero(), problem.lower()[i] = -0.0, problem.upper()[i] = 0;
    if (choice == 4 && equalities > 0) {
      problem.A().row(i) = problem.E().row(0);
      problem.lower()[i] = problem.upper()[i] = problem.e()[0];
    }
  }
}

/// The last row is minus a positive combination of others, out of reach.
void MakeInfeasible(Random& random, Problem& problem) {
  const auto rows = static_cast<int>(problem.A().rows()), n = static_cast<int>(problem.A().cols());
  const int count = 1 + random.Index(std::min(rows - 1, n));
  VectorXd sum = VectorXd::Zero(n);
  double side = 0;
  for (int i = 0; i < count; ++i) {
    const double y = random.Uniform(0.1, 1);
    const bool low = std::isfinite(problem.lower()[i]);
    sum += (low ? y : -y) * problem.A().row(i).transpose();
    side += low ? y * problem.lower()[i] : -y * problem.upper()[i];
  }
  problem.A().row(rows - 1) = sum.transpose();
  problem.lower()[rows - 1] = -kInfinity;
  problem.upper()[rows - 1] = side - random.Uniform(0.01, 1);
}

/// Every second row is nearly parallel to the one before it.
void MakeNearParallel(Random& random, const VectorXd& inside, Problem& problem) {
  const auto rows = static_cast<int>(problem.A().rows()), n = static_cast<int>(problem.A().cols());
  for (int i = 0; i + 1 < rows; i += 2) {
    CopyRow(i, i + 1, random.Index(2) == 0 ? 1 : -1, problem);
    const VectorXd nudge = LogUniform(random, -8, -4) * RandomVector(random, n);
    problem.A().row(i + 1) += nudge.transpose();
    const double value = problem.A().row(i + 1).dot(inside);
    problem.lower()[i + 1] = std::min(problem.lower()[i + 1], value);
    problem.upper()[i + 1] = std::max(problem.upper()[i + 1], value);
  }
}

/// Rows scaled by twelve orders of magnitude.
void ScaleRows(Random& random, Problem& problem) {
  const auto rows = static_cast<int>(problem.A().rows());
  for (int i = 0; i < rows; ++i) {
    const double scale = LogUniform(random, -6, 6);
    problem.A().row(i) *= scale;
    problem.lower()[i] *= scale;
    problem.upper()[i] *= scale;
  }
  problem.H() *= 1e3;
  problem.g() *= 1e3;
}

/// Variables scaled by twelve orders of magnitude.
void ScaleVariables(Random& random, Problem& problem) {
  const auto n = static_cast<int>(problem.A().cols());
  for (int j = 0; j < n; ++j) {
    const double scale = LogUniform(random, -6, 6);
    problem.H().row(j) *= scale;
    problem.H().col(j) *= scale;
    problem.g()[j] *= scale;
    problem.A().col(j) *= scale;
    problem.E().col(j) *= scale;
  }
}

/// Bounds on most variables, some of them fixed; some rows are equalities.
void AddBounds(Random& random, const VectorXd& inside, Problem& problem) {
  const auto rows = static_cast<int>(problem.A().rows()), n = static_cast<int>(problem.A().cols());
  for (int j = 0; j < n; ++j) {
    if (random.Index(3) > 0) problem.x_lower()[j] = inside[j] - random.Uniform(0, 0.5);
    if (random.Index(3) > 0) problem.x_upper()[j] = inside[j] + random.Uniform(0, 0.5);
    if (random.Index(8) == 0) problem.x_lower()[j] = problem.x_upper()[j] = inside[j];
  }
  for (int i = 0; i < std::min(rows, n / 2); ++i) {
    if (random.Index(4) == 0) {
      problem.lower()[i] = problem.upper()[i] = problem.A().row(i).dot(inside);
    }
  }
}

}  // namespace

std::string ToString(Kind kind) {
  constexpr const char* kNames[] = {
      "plain",          "unconstrained", "equalities", "degenerate",       "infeasible",
      "bad equalities", "near-parallel", "scaled",     "scaled variables", "boxed"};
  return kNames[static_cast<int>(kind)];
}

Problem RandomProblem(Random& random, Kind kind) {
  const int n = 1 + random.Index(12);
  const bool only_equalities = kind == Kind::kEqualities || kind == Kind::kBadEqualities;
  int equalities = random.Index(std::min(n, 4));
  int rows = 1 + random.Index(40);
  if (kind == Kind::kUnconstrained) equalities = rows = 0;
  if (only_equalities) rows = 0;
  if (kind == Kind::kDegenerate || kind == Kind::kNearParallel) rows = std::max(rows, 4);
  if (kind == Kind::kInfeasible) rows = std::max(rows, 2);
  if (only_equalities) equalities = std::max(2, std::min(6, equalities + 2));
  Problem problem(n, equalities, rows);
  const int rank = random.Index(2) == 0 ? n + 2 : std::max(1, n / 2);
  const MatrixXd J = RandomMatrix(random, rank, n);
  problem.H() = J.transpose() * J;
  problem.H().diagonal().array() += LogUniform(random, -4, 0);
  problem.g() = RandomVector(random, n) * (random.Index(8) == 0 ? 0.0 : 3.0);
  // A point that satisfies everything, unless the kind says otherwise.
  const VectorXd inside = RandomVector(random, n);
  problem.E() = RandomMatrix(random, equalities, n);
  problem.A() = RandomMatrix(random, rows, n);
  if (only_equalities) MakeEqualitiesDependent(random, kind, problem);
  problem.e() = problem.E() * inside;
  if (kind == Kind::kBadEqualities) problem.e()[1] += random.Uniform(0.1, 1);
  SetSides(random, kind, inside, problem);
  switch (kind) {
    case Kind::kDegenerate:
      MakeDegenerate(random, problem);
      break;
    case Kind::kInfeasible:
      MakeInfeasible(random, problem);
      break;
    case Kind::kNearParallel:
      MakeNearParallel(random, inside, problem);
      break;
    case Kind::kScaled:
      ScaleRows(random, problem);
      break;
    case Kind::kScaledVariables:
      ScaleVariables(random, problem);
      break;
    case Kind::kBoxed:
      AddBounds(random, inside, problem);
      break;
    default:
      break;
  }
  return problem;
}

double Cost(const Problem& problem, const VectorXd& x) {
  return 0.5 * x.dot(problem.H() * x) + problem.g().dot(x);
}

double CostScale(const Problem& problem, const VectorXd& x) {
  const VectorXd size = x.cwiseAbs();
  return 0.5 * size.dot(problem.H().cwiseAbs() * size) + problem.g().cwiseAbs().dot(size) +
         std::abs(Cost(problem, Unconstrained(problem)));
}

VectorXd Unconstrained(const Problem& problem) {
  return -MatrixXd(problem.H()).ldlt().solve(VectorXd(problem.g()));
}

Reference SolveByInteriorPoint(const Problem& problem) {
  const int n = problem.num_variables();
  // Variables scaled to a unit diagonal of H, rows to unit length.
  const VectorXd unit = problem.H().diagonal().cwiseSqrt().cwiseInverse();
  const MatrixXd H = unit.asDiagonal() * problem.H() * unit.asDiagonal();
  const VectorXd g = unit.cwiseProduct(problem.g());
  std::vector<VectorXd> normals;
  std::vector<double> sides;
  const auto add = [&](VectorXd a, double lower, double upper) {
    a = unit.cwiseProduct(a);
    const double length = a.norm() > 0 ? a.norm() : 1;
    for (const double sign : {1.0, -1.0}) {
      const double side = sign > 0 ? lower : -upper;
      if (!std::isfinite(side)) continue;
      normals.push_back(sign * a / length);
      sides.push_back(side / length);
    }
  };
  for (int i = 0; i < problem.num_inequalities(); ++i) {
    add(problem.A().row(i), problem.lower()[i], problem.upper()[i]);
  }
  for (int j = 0; j < n; ++j) add(VectorXd::Unit(n, j), problem.x_lower()[j], problem.x_upper()[j]);
  for (int i = 0; i < problem.num_equalities(); ++i) add(problem.E().row(i), problem.e()[i], problem.e()[i]);
  const int m = static_cast<int>(sides.size());
  MatrixXd A(m, n);
  VectorXd b(m);
  for (int i = 0; i < m; ++i) {
    A.row(i) = normals[i].transpose();
    b[i] = sides[i];
  }
  VectorXd x = VectorXd::Zero(n), s = VectorXd::Ones(m), y = VectorXd::Ones(m);
  Reference reference;
  // Equal sides leave no interior; a violation below this is met.
  constexpr double kLoose = 1e-9;
  for (int iteration = 0; iteration < 100; ++iteration) {
    const VectorXd rd = H * x + g - A.transpose() * y;
    const VectorXd rp = A * x - s - b;
    const double mu = m > 0 ? s.dot(y) / m : 0;
    const double scale = 1 + x.norm() + b.norm();
    if (rd.norm() < 1e-8 * (1 + g.norm() + y.norm()) && rp.norm() < kLoose * scale &&
        m * mu < 1e-9 * (1 + std::abs(0.5 * x.dot(H * x) + g.dot(x)))) {
      reference.converged = true;
      break;
    }
    const VectorXd weight = y.cwiseQuotient(s);
    const Eigen::LDLT<MatrixXd> factor(H + A.transpose() * weight.asDiagonal() * A);
    VectorXd dx, ds, dy;
    const auto step_for = [&](const VectorXd& target) {
      const VectorXd t = target.cwiseQuotient(s);  // of dy + weight ds
      dx = factor.solve(-rd + A.transpose() * (t - weight.cwiseProduct(rp)));
      ds = A * dx + rp;
      dy = t - weight.cwiseProduct(ds);
    };
    const auto longest = [&] {
      double step = 1;
      for (int i = 0; i < m; ++i) {
        if (ds[i] < 0) step = std::min(step, -0.99 * s[i] / ds[i]);
        if (dy[i] < 0) step = std::min(step, -0.99 * y[i] / dy[i]);
      }
      return step;
    };
    step_for(-s.cwiseProduct(y));
    const double affine = longest();
    const double after = m > 0 ? (s + affine * ds).dot(y + affine * dy) / m : 0;
    const double sigma = mu > 0 ? std::pow(after / mu, 3) : 0;
    step_for(VectorXd::Constant(m, sigma * mu) - s.cwiseProduct(y) - ds.cwiseProduct(dy));
    const double step = longest();
    x += step * dx;
    s += step * ds;
    y += step * dy;
    if (!x.allFinite() || (m > 0 && y.maxCoeff() > 1e16)) break;
  }
  reference.x = unit.cwiseProduct(x);
  return reference;
}

}  // namespace tether::qp::testing
