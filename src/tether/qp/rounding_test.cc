#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/QR>

#include "tether/common/random.h"
#include "tether/qp/kkt.h"
#include "tether/qp/solver.h"

/// The effects of rounding that are allowed on a solution, and those that are not.
namespace tether::qp {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd RandomMatrix(Random& random, int rows, int columns) {
  MatrixXd matrix(rows, columns);
  for (double& entry : matrix.reshaped()) entry = random.Normal();
  return matrix;
}

TEST(RoundingTest, ResidualsAreRefinedHoweverBadTheConditionIs) {
  for (const int digits : {0, 4, 8, 12, 14}) {
    for (uint64_t seed = 1; seed <= 200; ++seed) {
      Random random(seed);
      const int n = 2 + random.Index(11), m = 2 + random.Index(20);
      Problem problem(n, 0, m);
      const MatrixXd Q = Eigen::HouseholderQR<MatrixXd>(RandomMatrix(random, n, n)).householderQ();
      VectorXd eigenvalues(n);
      for (double& eigenvalue : eigenvalues) eigenvalue = std::pow(10, -random.Uniform(0, digits));
      const MatrixXd H = Q * eigenvalues.asDiagonal() * Q.transpose();
      problem.H() = 0.5 * (H + H.transpose());
      problem.g() = RandomMatrix(random, n, 1);
      problem.A() = RandomMatrix(random, m, n);
      problem.lower() = problem.A() * RandomMatrix(random, n, 1);
      for (double& side : problem.lower()) side -= 1e-3 * random.Uniform(0, 1);
      Solver solver(n, 0, m);
      ASSERT_EQ(solver.Solve(problem, Start::kCold), Status::kSolved) << digits << ", seed " << seed;
      EXPECT_LE(ComputeKktResidual(problem, solver.x(), solver.active()).largest(), 1.01e-14)
          << digits << ", seed " << seed;
    }
  }
}

/// The nearest point to the origin with first coordinate at most 1, above a line that is turned by `angle`
/// against that bound and meets it at (1, 5).
Problem Wedge(double angle, bool as_rows) {
  Problem problem(2, 0, 2);
  problem.H().setIdentity();
  problem.A().row(0) << (as_rows ? -1 : 0), 0;
  problem.lower()[0] = as_rows ? -1 : 0;
  if (!as_rows) problem.x_upper()[0] = 1;
  problem.A().row(1) << 1, angle;
  problem.lower()[1] = 1 + 5 * angle;
  return problem;
}

TEST(RoundingTest, RowsThatAreNearlyOppositeStillMeet) {
  for (const double angle : {1e-2, 1e-5, 1e-7, 1e-9, 1e-10}) {
    for (const bool as_rows : {false, true}) {
      const Problem problem = Wedge(angle, as_rows);
      Solver solver(2, 0, 2);
      for (const Start start : {Start::kCold, Start::kWarm}) {
        ASSERT_EQ(solver.Solve(problem, start), Status::kSolved) << angle;
        EXPECT_NEAR(solver.x()[0], 1, 1e-12) << angle;
        EXPECT_NEAR(solver.x()[1], 5, 1e-14 / angle) << angle;
      }
    }
  }
}

TEST(RoundingTest, RowsThatAreOppositeButForRoundingDoNotMoveTheSolutionFar) {
  // Rounding decides where they meet, arbitrarily far away. Violations of that size count as satisfied.
  for (const double angle : {1e-14, 5e-14, 1e-13}) {
    for (const bool as_rows : {false, true}) {
      const Problem problem = Wedge(angle, as_rows);
      Solver solver(2, 0, 2);
      ASSERT_EQ(solver.Solve(problem, Start::kCold), Status::kSolved) << angle;
      EXPECT_NEAR(solver.x()[0], 1, 1e-12) << angle;
      EXPECT_NEAR(solver.x()[1], 0, 1e-6) << angle;
    }
  }
}

}  // namespace
}  // namespace tether::qp
