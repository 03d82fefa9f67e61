#include "tether/qp/solver.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "testing/common/heap_counter.h"
#include "testing/qp/test_problems.h"
#include "tether/common/random.h"
#include "tether/qp/example_problems.h"
#include "tether/qp/hierarchy.h"
#include "tether/qp/kkt.h"

namespace tether::qp {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::Kind;
using testing::RandomProblem;

constexpr double kKktTolerance = 1e-12;

/// In the norm of H, relative to x and the minimiser without constraints.
double Distance(const Problem& problem, const VectorXd& a, const VectorXd& b) {
  const auto norm = [&](const VectorXd& x) { return std::sqrt(x.dot(problem.H() * x)); };
  const double distance = norm(a - b);
  return distance == 0 ? 0 : distance / std::max(norm(b), norm(testing::Unconstrained(problem)));
}

/// Solves, and checks all that must hold of the result alone.
Status SolveAndCheck(Solver& solver, const Problem& problem, Start start, const std::string& what) {
  const Status status = solver.Solve(problem, start);
  if (status == Status::kSolved) {
    EXPECT_LE(ComputeKktResidual(problem, solver.x(), solver.active()).largest(), kKktTolerance) << what;
    EXPECT_TRUE(solver.conflict().empty());
  } else if (status == Status::kInfeasible) {
    const FarkasCheck check = CheckFarkas(problem, solver.conflict());
    EXPECT_GT(check.gap, 0) << what;
    EXPECT_GT(check.radius(), 1e8) << what;
  } else {
    ADD_FAILURE() << what << ": " << ToString(status);
  }
  return status;
}

TEST(SolverTest, TenThousandRandomProblemsAgreeWithAnInteriorPointMethod) {
  Random random(1);
  Solver solver(12, 6, 40);
  Solver again(12, 6, 40);
  int solved = 0, infeasible = 0, compared = 0;
  for (int trial = 0; trial < 10000; ++trial) {
    const Kind kind = static_cast<Kind>(trial % testing::kNumKinds);
    const Problem problem = RandomProblem(random, kind);
    const std::string what = "trial " + std::to_string(trial) + ", " + testing::ToString(kind);
    const Status status = SolveAndCheck(solver, problem, Start::kCold, what);
    const VectorXd x = solver.x();
    // The start is that of an unrelated problem.
    ASSERT_EQ(SolveAndCheck(again, problem, Start::kWarm, what + ", warm"), status) << what;
    if (status == Status::kSolved) {
      ++solved;
      EXPECT_LE(Distance(problem, again.x(), x), 1e-10) << what;
    } else {
      ++infeasible;
    }
    const testing::Reference reference = testing::SolveByInteriorPoint(problem);
    if (status == Status::kSolved && reference.converged) {
      ++compared;
      const double scale = testing::CostScale(problem, x);
      EXPECT_LE(testing::Cost(problem, x), testing::Cost(problem, reference.x) + 1e-7 * scale) << what;
    }
    // A point of the other method that satisfies all rows well refutes a claim of infeasibility.
    EXPECT_FALSE(status == Status::kInfeasible && reference.converged) << what;
  }
  EXPECT_GT(solved, 5000);
  EXPECT_GT(infeasible, 500);
  EXPECT_GT(compared, solved * 9 / 10);
}

/// An oracle, exact for small problems: tries all active sets one after another.
Status SolveByEnumeration(const Problem& problem, VectorXd& best) {
  struct Side {
    VectorXd a;
    double side;
    bool equality;
  };
  const int n = problem.num_variables();
  std::vector<Side> sides;
  const auto add = [&](const VectorXd& a, double lower, double upper) {
    if (std::isfinite(lower)) sides.push_back({a, lower, false});
    if (std::isfinite(upper)) sides.push_back({-a, -upper, false});
  };
  for (int i = 0; i < problem.num_inequalities(); ++i) {
    add(problem.A().row(i).transpose(), problem.lower()[i], problem.upper()[i]);
  }
  for (int j = 0; j < n; ++j) add(VectorXd::Unit(n, j), problem.x_lower()[j], problem.x_upper()[j]);
  const int count = static_cast<int>(sides.size()), equalities = problem.num_equalities();
  double least = kInfinity;
  for (unsigned set = 0; set < 1u << count; ++set) {
    const int q = equalities + __builtin_popcount(set);
    if (q > n) continue;
    MatrixXd kkt = MatrixXd::Zero(n + q, n + q);
    VectorXd rhs(n + q);
    kkt.topLeftCorner(n, n) = problem.H();
    rhs.head(n) = -problem.g();
    int row = n;
    const auto hold = [&](const VectorXd& a, double side) {
      kkt.row(row).head(n) = a.transpose();
      kkt.col(row).head(n) = a;
      rhs[row++] = side;
    };
    for (int k = 0; k < equalities; ++k) hold(problem.E().row(k).transpose(), problem.e()[k]);
    for (int k = 0; k < count; ++k) {
      if (set >> k & 1) hold(sides[k].a, sides[k].side);
    }
    const Eigen::FullPivLU<MatrixXd> lu(kkt);
    if (!lu.isInvertible()) continue;
    const VectorXd x = lu.solve(rhs).head(n);
    const bool feasible = std::all_of(sides.begin(), sides.end(),
                                      [&](const Side& side) { return side.a.dot(x) >= side.side - 1e-9; });
    if (feasible && testing::Cost(problem, x) < least) {
      least = testing::Cost(problem, x);
      best = x;
    }
  }
  return least < kInfinity ? Status::kSolved : Status::kInfeasible;
}

TEST(SolverTest, SmallProblemsAgreeWithEnumeration) {
  Random random(2);
  Solver solver(4, 2, 8);
  int infeasible = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const int n = 1 + random.Index(4);
    Problem problem(n, random.Index(2) * (n > 1), random.Index(8));
    for (double& entry : problem.H().reshaped()) entry = random.Normal();
    problem.H() = MatrixXd(problem.H().transpose() * problem.H()) + 0.1 * MatrixXd::Identity(n, n);
    for (double& entry : problem.g()) entry = random.Normal();
    for (int i = 0; i < problem.num_inequalities(); ++i) {
      for (int j = 0; j < n; ++j) problem.A()(i, j) = random.Index(5) - 2;
      problem.lower()[i] = random.Index(4) - 2;
    }
    for (int k = 0; k < problem.num_equalities(); ++k) {
      for (int j = 0; j < n; ++j) problem.E()(k, j) = random.Normal();
      problem.e()[k] = random.Normal();
    }
    for (int j = 0; j < std::min(n, 2); ++j) problem.x_upper()[j] = random.Index(3);
    VectorXd best;
    const Status expected = SolveByEnumeration(problem, best);
    const std::string what = "trial " + std::to_string(trial);
    ASSERT_EQ(SolveAndCheck(solver, problem, Start::kCold, what), expected) << what;
    if (expected == Status::kSolved) {
      EXPECT_LE((solver.x() - best).norm(), 1e-8 * (1 + best.norm())) << what;
    } else {
      ++infeasible;
    }
  }
  EXPECT_GT(infeasible, 30);
}

TEST(SolverTest, SequencesAgreeWarmAndCold) {
  for (const int n : {6, 7, 8, 11, 20}) {
    ControlSequence sequence(n, 40, static_cast<uint64_t>(n));
    Problem problem(n, 0, 40);
    Solver cold(n, 0, 40), warm(n, 0, 40);
    int cold_iterations = 0, warm_iterations = 0;
    for (int tick = 0; tick < 1000; ++tick) {
      if (tick % 100 == 99) sequence.Jump();
      sequence.Next(0.005, problem);
      ASSERT_EQ(SolveAndCheck(cold, problem, Start::kCold, "cold"), Status::kSolved);
      ASSERT_EQ(SolveAndCheck(warm, problem, Start::kWarm, "warm"), Status::kSolved);
      EXPECT_LE((warm.x() - cold.x()).cwiseAbs().maxCoeff(), 1e-10 * cold.x().cwiseAbs().maxCoeff());
      cold_iterations += cold.iterations();
      warm_iterations += warm.iterations();
    }
    EXPECT_LT(10 * warm_iterations, 2 * cold_iterations) << n;
  }
}

TEST(SolverTest, OrderOfRowsDoesNotMatter) {
  Random random(3);
  Solver solver(12, 6, 40);
  for (int trial = 0; trial < 500; ++trial) {
    const Problem problem = RandomProblem(random, static_cast<Kind>(trial % testing::kNumKinds));
    const Status status = solver.Solve(problem, Start::kCold);
    const VectorXd x = solver.x();
    Problem shuffled = problem;
    const int m = problem.num_inequalities();
    for (int i = m - 1; i > 0; --i) {
      const int j = random.Index(i + 1);
      shuffled.A().row(i).swap(shuffled.A().row(j));
      std::swap(shuffled.lower()[i], shuffled.lower()[j]);
      std::swap(shuffled.upper()[i], shuffled.upper()[j]);
    }
    ASSERT_EQ(solver.Solve(shuffled, Start::kCold), status) << trial;
    if (status == Status::kSolved) {
      EXPECT_LE(Distance(problem, solver.x(), x), 1e-10) << trial;
    }
  }
}

TEST(SolverTest, EveryInstructionSetGivesTheSameBits) {
  Random random(4);
  SolverOptions options;
  options.instructions = Instructions::kBaseline;
  Solver best(20, 6, 40), baseline(20, 6, 40, options);
  for (int trial = 0; trial < 500; ++trial) {
    const Problem problem = RandomProblem(random, static_cast<Kind>(trial % testing::kNumKinds));
    ASSERT_EQ(best.Solve(problem), baseline.Solve(problem));
    if (best.status() != Status::kSolved) continue;
    EXPECT_EQ(VectorXd(best.x()), VectorXd(baseline.x())) << trial;
  }
}

TEST(SolverTest, TheSameCallsGiveTheSameBits) {
  std::vector<VectorXd> first;
  for (int run = 0; run < 2; ++run) {
    ControlSequence sequence(7, 40, 5);
    Problem problem(7, 0, 40);
    Solver solver(7, 0, 40);
    for (int tick = 0; tick < 200; ++tick) {
      sequence.Next(0.01, problem);
      solver.Solve(problem);
      if (run == 0) {
        first.emplace_back(solver.x());
      } else {
        EXPECT_EQ(first[tick], VectorXd(solver.x()));
      }
    }
  }
}

TEST(SolverTest, BadInputIsAStatus) {
  ControlSequence sequence(7, 40, 6);
  Problem good(7, 2, 40);
  Solver solver(7, 2, 40);
  sequence.Next(0, good);
  ASSERT_EQ(solver.Solve(good), Status::kSolved);
  const double nan = std::nan("");
  for (const double bad : {nan, kInfinity, -kInfinity}) {
    for (int i = 0; i < 7; ++i) {
      Problem problem = good;
      problem.H()(i, 6 - i) = problem.H()(6 - i, i) = bad;
      EXPECT_EQ(solver.Solve(problem), Status::kBadInput) << bad << " in H, " << i;
      problem = good;
      problem.g()[i] = bad;
      EXPECT_EQ(solver.Solve(problem), Status::kBadInput) << bad << " in g";
      problem = good;
      problem.A()(5 * i, i) = bad;
      EXPECT_EQ(solver.Solve(problem), Status::kBadInput) << bad << " in A";
      problem = good;
      if (bad != -kInfinity) problem.lower()[5 * i] = bad;
      if (bad == -kInfinity) problem.upper()[5 * i] = bad;
      EXPECT_EQ(solver.Solve(problem), Status::kBadInput) << bad << " in sides";
      problem = good;
      if (bad != -kInfinity) problem.x_lower()[i] = bad;
      if (bad == -kInfinity) problem.x_upper()[i] = bad;
      EXPECT_EQ(solver.Solve(problem), Status::kBadInput) << bad << " in bounds";
    }
  }
  Problem problem = good;
  problem.H()(3, 3) = -1;
  EXPECT_EQ(solver.Solve(problem), Status::kBadInput);
  problem.H().setZero();
  EXPECT_EQ(solver.Solve(problem), Status::kBadInput);
  problem.Resize(2, 1, 0);
  problem.H().setIdentity();
  problem.E() << 1, nan;
  EXPECT_EQ(solver.Solve(problem), Status::kBadInput);
  EXPECT_EQ(solver.Solve(good), Status::kSolved) << "bad input leaves no trace";
}

TEST(SolverTest, IterationLimitIsAStatus) {
  SolverOptions options;
  options.max_iterations = 1;
  Solver solver(2, 0, 0, options);
  Problem problem(2, 0, 0);
  problem.H().setIdentity();
  problem.x_lower() << 1, 1;
  EXPECT_EQ(solver.Solve(problem), Status::kIterationLimit);
}

TEST(SolverTest, CrossedSidesAreAConflictOfOneRow) {
  Problem problem(2, 0, 1);
  problem.H().setIdentity();
  problem.A() << 1, 2;
  problem.lower()[0] = 1;
  problem.upper()[0] = 0;
  Solver solver(2, 0, 1);
  ASSERT_EQ(solver.Solve(problem), Status::kInfeasible);
  ASSERT_EQ(solver.conflict().size(), 2);
  EXPECT_EQ(solver.conflict()[0].index, 0);
  EXPECT_EQ(solver.conflict()[0].weight, -solver.conflict()[1].weight);
  EXPECT_EQ(CheckFarkas(problem, solver.conflict()).gap, 1);
}

TEST(SolverTest, ProblemsCanBeCopiedAndResized) {
  ControlSequence sequence(9, 13, 8);
  Problem problem(24, 5, 50);
  Solver solver(24, 5, 50);
  sequence.Next(0, problem);
  ASSERT_EQ(solver.Solve(problem), Status::kSolved);
  const VectorXd x = solver.x();
  const Problem copy = problem;
  problem.Resize(3, 0, 0);
  EXPECT_EQ(problem.H().sum(), 0);
  EXPECT_EQ(problem.x_upper()[2], kInfinity);
  ASSERT_EQ(solver.Solve(copy, Start::kCold), Status::kSolved);
  EXPECT_EQ(VectorXd(solver.x()), x);
}

#ifdef TETHER_COUNTS_ALLOCATIONS
TEST(SolverTest, SolvingDoesNotAllocate) {
  Random random(9);
  std::vector<Problem> problems;
  for (int i = 0; i < 100; ++i) {
    problems.push_back(RandomProblem(random, static_cast<Kind>(i % testing::kNumKinds)));
  }
  Solver solver(12, 6, 40);
  HierarchySolver hierarchy(12, 6, 40);
  const std::vector<int> levels(40, 1);
  const long before = heap_allocations;
  for (const Problem& problem : problems) {
    solver.Solve(problem, Start::kCold);
    solver.Solve(problem, Start::kWarm);
    hierarchy.Solve(problem, {levels.data(), static_cast<size_t>(problem.num_inequalities())});
  }
  const long after = heap_allocations;
  EXPECT_EQ(after, before);
  problems.emplace_back(3, 0, 3);
  EXPECT_GT(heap_allocations, after) << "the count works";
}
#endif

}  // namespace
}  // namespace tether::qp
