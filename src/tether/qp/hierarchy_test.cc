#include "tether/qp/hierarchy.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "testing/qp/test_problems.h"
#include "tether/common/random.h"
#include "tether/qp/kkt.h"

namespace tether::qp {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Whether a point satisfies everything with the given violations, of rows with `level` ≤ `last` only.
bool Feasible(Problem problem, const std::vector<int>& levels, const VectorXd& violations, int last) {
  for (int i = 0; i < problem.num_inequalities(); ++i) {
    const bool counts = levels[i] <= last;
    problem.lower()[i] = counts ? problem.lower()[i] - violations[i] : -kInfinity;
    problem.upper()[i] = counts ? problem.upper()[i] + violations[i] : kInfinity;
  }
  Solver solver(problem.num_variables(), problem.num_equalities(), problem.num_inequalities());
  return solver.Solve(problem, Start::kCold) == Status::kSolved;
}

/// The lexicographic min-max by bisection, one row after another: a row keeps the largest violation of its
/// level if everything is infeasible with less of it.
VectorXd ViolationsByBisection(const Problem& problem, const std::vector<int>& levels) {
  const int m = problem.num_inequalities();
  VectorXd violations = VectorXd::Zero(m);
  for (int level = 1; level <= *std::max_element(levels.begin(), levels.end()); ++level) {
    std::vector<int> free;
    for (int i = 0; i < m; ++i) {
      if (levels[i] == level) free.push_back(i);
    }
    while (!free.empty()) {
      const auto with = [&](double v) {
        VectorXd trial = violations;
        for (const int i : free) trial[i] = v;
        return trial;
      };
      if (Feasible(problem, levels, with(1e-9), level)) break;
      double low = 0, high = 100;
      while (high - low > 1e-10) {
        const double middle = 0.5 * (low + high);
        (Feasible(problem, levels, with(middle), level) ? high : low) = middle;
      }
      std::vector<int> rest;
      for (const int i : free) {
        VectorXd trial = with(high + 1e-9);
        trial[i] = high - 1e-5;
        if (Feasible(problem, levels, trial, level)) {
          rest.push_back(i);
        } else {
          violations[i] = high;
        }
      }
      if (rest.size() == free.size()) break;
      free = rest;
    }
  }
  return violations;
}

Problem ConflictingProblem(Random& random, int n, int m) {
  Problem problem(n, 0, m);
  for (double& entry : problem.H().reshaped()) entry = random.Normal();
  problem.H() = MatrixXd(problem.H().transpose() * problem.H()) + 0.1 * MatrixXd::Identity(n, n);
  for (double& entry : problem.g()) entry = random.Normal();
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j < n; ++j) problem.A()(i, j) = random.Normal();
    problem.lower()[i] = random.Uniform(-1, 1);
    if (random.Index(3) == 0) problem.upper()[i] = problem.lower()[i] + random.Uniform(0, 1);
  }
  problem.x_lower().setConstant(-1);
  problem.x_upper().setConstant(1);
  return problem;
}

TEST(HierarchyTest, WithoutConflictItIsThePlainSolver) {
  Random random(1);
  Problem problem = ConflictingProblem(random, 7, 3);
  problem.lower().setConstant(-1);
  problem.upper().setConstant(kInfinity);
  HierarchySolver hierarchy(7, 0, 3);
  Solver solver(7, 0, 3);
  const std::vector<int> levels{1, 2, 0};
  ASSERT_EQ(solver.Solve(problem), Status::kSolved);
  ASSERT_EQ(hierarchy.Solve(problem, levels), Status::kSolved);
  EXPECT_EQ(VectorXd(hierarchy.x()), VectorXd(solver.x()));
  EXPECT_EQ(hierarchy.solves(), 1);
  EXPECT_EQ(hierarchy.num_relaxed(), 0);
}

TEST(HierarchyTest, TwoWallsTooCloseShareTheViolation) {
  // x₀ ≥ 1 and x₀ ≤ 0 conflict; x₁ ≥ 0.5 does not and holds exactly.
  Problem problem(2, 0, 3);
  problem.H().setIdentity();
  problem.A() << 1, 0, 1, 0, 0, 1;
  problem.lower() << 1, -kInfinity, 0.5;
  problem.upper()[1] = 0;
  HierarchySolver hierarchy(2, 0, 3);
  ASSERT_EQ(hierarchy.Solve(problem, std::vector<int>{1, 1, 1}), Status::kSolved);
  EXPECT_NEAR(hierarchy.x()[0], 0.5, 1e-12);
  EXPECT_NEAR(hierarchy.x()[1], 0.5, 1e-12);
  EXPECT_NEAR(hierarchy.violations()[0], 0.5, 1e-12);
  EXPECT_NEAR(hierarchy.violations()[1], 0.5, 1e-12);
  EXPECT_EQ(hierarchy.violations()[2], 0);
  EXPECT_EQ(hierarchy.num_relaxed(), 2);
  // The larger level is relaxed first, and a row that must hold is not relaxed at all.
  ASSERT_EQ(hierarchy.Solve(problem, std::vector<int>{1, 2, 1}), Status::kSolved);
  EXPECT_NEAR(hierarchy.x()[0], 1, 1e-12);
  ASSERT_EQ(hierarchy.Solve(problem, std::vector<int>{3, 2, 1}), Status::kSolved);
  EXPECT_NEAR(hierarchy.x()[0], 0, 1e-12);
  ASSERT_EQ(hierarchy.Solve(problem, std::vector<int>{0, 1, 1}), Status::kSolved);
  EXPECT_NEAR(hierarchy.x()[0], 1, 1e-12);
  ASSERT_EQ(hierarchy.Solve(problem, std::vector<int>{0, 0, 1}), Status::kInfeasible);
  EXPECT_EQ(hierarchy.solver().conflict().size(), 2);
  EXPECT_GT(CheckFarkas(problem, hierarchy.solver().conflict()).gap, 0);
}

TEST(HierarchyTest, RowsThatHardlyDependOnAnythingAreRelaxed) {
  // As of a link that turns about its own axis, with rounding for its derivative.
  for (const double dust : {0.0, 5e-18, -3e-17, 1e-14}) {
    Problem problem(3, 0, 3);
    problem.H().setIdentity();
    problem.A() << dust, 0, 0, 0, 1, 0, 0, 0, 1;
    problem.lower() << 0.0094585570994127899, 0.3, 0.5;
    problem.x_lower().setConstant(-0.6);
    problem.x_upper().setConstant(0.4);
    HierarchySolver hierarchy(3, 0, 3);
    ASSERT_EQ(hierarchy.Solve(problem, std::vector<int>{1, 1, 2}), Status::kSolved) << dust;
    EXPECT_NEAR(hierarchy.violations()[0], problem.lower()[0], 1e-13);
    EXPECT_NEAR(hierarchy.violations()[2], 0.1, 1e-12);
    EXPECT_NEAR(hierarchy.x()[1], 0.3, 1e-9);
    EXPECT_LT(hierarchy.solves(), 40);
  }
}

TEST(HierarchyTest, ViolationsAgreeWithBisection) {
  Random random(2);
  int relaxed = 0;
  HierarchySolver hierarchy(4, 0, 8);
  for (int trial = 0; trial < 150; ++trial) {
    const int n = 2 + random.Index(3), m = 3 + random.Index(6);
    const Problem problem = ConflictingProblem(random, n, m);
    std::vector<int> levels;
    for (int i = 0; i < m; ++i) levels.push_back(1 + random.Index(3));
    ASSERT_EQ(hierarchy.Solve(problem, levels), Status::kSolved) << trial;
    const VectorXd expected = ViolationsByBisection(problem, levels);
    const Eigen::Map<const VectorXd> found(hierarchy.violations().data(), m);
    EXPECT_LE((found - expected).cwiseAbs().maxCoeff(), 1e-6) << trial << "\n"
                                                              << found.transpose() << "\n"
                                                              << expected.transpose();
    relaxed += hierarchy.num_relaxed() > 0;
    // What remains is the plain problem with these violations.
    Problem loose = problem;
    loose.lower() -= found;
    loose.upper() += found;
    EXPECT_LE(ComputeKktResidual(loose, hierarchy.x(), hierarchy.solver().active()).largest(), 1e-11)
        << trial;
  }
  EXPECT_GT(relaxed, 75);
}

TEST(HierarchyTest, BoundsAlwaysHold) {
  Random random(3);
  HierarchySolver hierarchy(7, 0, 60);
  for (int trial = 0; trial < 300; ++trial) {
    const Problem problem = ConflictingProblem(random, 7, 60);
    std::vector<int> levels;
    for (int i = 0; i < 60; ++i) levels.push_back(1 + random.Index(4));
    ASSERT_EQ(hierarchy.Solve(problem, levels), Status::kSolved) << trial;
    EXPECT_LE(hierarchy.x().cwiseAbs().maxCoeff(), 1 + 1e-12);
    for (int i = 0; i < 60; ++i) {
      const double value = problem.A().row(i).dot(hierarchy.x()), v = hierarchy.violations()[i];
      EXPECT_GE(value, problem.lower()[i] - v - 1e-11);
      EXPECT_LE(value, problem.upper()[i] + v + 1e-11);
    }
  }
}

TEST(HierarchyTest, OnlyWhatMustGiveGives) {
  // Smaller violations of a level are impossible even if every later level is dropped.
  Random random(4);
  HierarchySolver hierarchy(5, 0, 20);
  for (int trial = 0; trial < 50; ++trial) {
    const Problem problem = ConflictingProblem(random, 5, 20);
    std::vector<int> levels;
    for (int i = 0; i < 20; ++i) levels.push_back(1 + i % 3);
    ASSERT_EQ(hierarchy.Solve(problem, levels), Status::kSolved);
    VectorXd less = Eigen::Map<const VectorXd>(hierarchy.violations().data(), 20);
    double largest = 0;
    for (int i = 0; i < 20; i += 3) largest = std::max(largest, less[i]);
    if (largest == 0) continue;
    EXPECT_TRUE(Feasible(problem, levels, less.array() + 1e-9, 3));
    for (int i = 0; i < 20; i += 3) less[i] = largest - 1e-6;
    EXPECT_FALSE(Feasible(problem, levels, less, 1)) << trial;
  }
}

}  // namespace
}  // namespace tether::qp
