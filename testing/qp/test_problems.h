#pragma once

#include <string>

#include <Eigen/Core>

#include "tether/common/random.h"
#include "tether/qp/problem.h"

namespace tether::qp::testing {

enum class Kind {
  kPlain,  ///< Feasible, a few rows active.
  kUnconstrained,
  kEqualities,     ///< Equalities only, some of them dependent but consistent.
  kDegenerate,     ///< Many rows through the solution, duplicated, scaled and summed ones among them.
  kInfeasible,     ///< A positive combination of rows that cannot hold.
  kBadEqualities,  ///< Dependent equalities that contradict each other.
  kNearParallel,   ///< Pairs of rows that differ by 1e-4 to 1e-8.
  kScaled,         ///< Rows scaled by 1e-6 to 1e6.
  kScaledVariables,
  kBoxed,  ///< Bounds, two-sided rows, rows with equal sides.
};
inline constexpr int kNumKinds = 10;

std::string ToString(Kind kind);

/// A random problem of up to 12 variables, 6 equalities and 40 inequalities.
Problem RandomProblem(Random& random, Kind kind);

double Cost(const Problem& problem, const Eigen::VectorXd& x);
/// The scale of the cost's rounding.
double CostScale(const Problem& problem, const Eigen::VectorXd& x);
/// −H⁻¹ g
Eigen::VectorXd Unconstrained(const Problem& problem);

struct Reference {
  bool converged = false;
  Eigen::VectorXd x;
};

/// Mehrotra's predictor–corrector on normalised one-sided rows: slow, and shares nothing with the solver.
Reference SolveByInteriorPoint(const Problem& problem);

}  // namespace tether::qp::testing
