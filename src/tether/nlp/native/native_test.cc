#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "testing/common/heap_counter.h"
#include "testing/common/needs_plugin.h"
#include "testing/nlp/test_programs.h"
#include "tether/nlp/native/block_cholesky.h"
#include "tether/nlp/native/elastic_qp.h"
#include "tether/nlp/native/manifold_view.h"
#include "tether/nlp/solver.h"

namespace tether::nlp {
namespace {

using namespace testing;  // NOLINT

/// Rows of a chain with some of them far from feasible, in the solver's form.
struct Subproblem {
  explicit Subproblem(const Example& example) : view(example.program), values(view.MakeValues()), qp(view) {
    EXPECT_TRUE(view.Evaluate(view.Start(example.guess), values));
  }
  ManifoldView view;
  ManifoldView::Values values;
  ElasticQp qp;
};

TEST(EliminationPositionsTest, ATreeFillsNothing) {
  // A star: its middle goes last, or next to last among equals.
  const std::vector<int> star = EliminationPositions(5, {{0, 1}, {0, 2}, {0, 3}, {0, 4}});
  EXPECT_GE(star[0], 3);
  const std::vector<std::pair<int, int>> path{{0, 1}, {1, 2}, {2, 3}, {3, 4}};
  const std::vector<int> positions = EliminationPositions(5, path);
  std::vector<std::pair<int, int>> edges;
  for (const auto& [i, j] : path) edges.emplace_back(positions[i], positions[j]);
  EXPECT_EQ(BlockCholesky(5, edges).num_slots(), 5 + 4);
}

TEST(BlockCholeskyTest, SolvesLikeADenseFactorisation) {
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const int count = 2 + trial % 6;
    std::vector<std::pair<int, int>> edges;
    for (int i = 0; i < count; ++i) {
      for (int j = 0; j < i; ++j) {
        if (random.Uniform(0, 1) < 0.4) edges.emplace_back(i, j);
      }
    }
    BlockCholesky factor(count, edges);
    MatrixXd dense = 0.1 * MatrixXd::Identity(6 * count, 6 * count);
    edges.emplace_back(0, 0);
    for (const auto& [i, j] : edges) {
      MatrixXd rows = MatrixXd::Zero(4, 6 * count);
      for (int r = 0; r < 4; ++r) {
        for (int k = 0; k < 6; ++k) {
          rows(r, 6 * i + k) = random.Normal();
          rows(r, 6 * j + k) = random.Normal();
        }
      }
      dense += rows.transpose() * rows;
    }
    for (int i = 0; i < count; ++i) factor.blocks()[factor.Slot(i, i)] = dense.block<6, 6>(6 * i, 6 * i);
    for (const auto& [i, j] : edges) factor.blocks()[factor.Slot(i, j)] = dense.block<6, 6>(6 * i, 6 * j);
    VectorXd b(6 * count);
    for (int k = 0; k < b.size(); ++k) b[k] = random.Normal();
    VectorXd x = b;
    factor.Factorize();
    factor.Solve(x);
    EXPECT_LT((x - dense.llt().solve(b)).norm(), 1e-9 * (1 + x.norm()));
  }
}

TEST(ManifoldViewTest, DerivativesAreThoseOfTheValues) {
  const Example example = KeyPoseChain(3, 5, 0.5);
  Subproblem at(example);
  Random random(2);
  VectorXd d(at.view.num_coordinates());
  for (int k = 0; k < d.size(); ++k) d[k] = random.Normal();
  constexpr double kStep = 1e-5;
  Point moved = example.guess;
  ManifoldView::Values up = at.view.MakeValues(), down = at.view.MakeValues();
  at.view.Move(example.guess, d, kStep, moved);
  ASSERT_TRUE(at.view.Evaluate(moved, up));
  at.view.Move(example.guess, d, -kStep, moved);
  ASSERT_TRUE(at.view.Evaluate(moved, down));
  VectorXd Jd(at.view.num_rows());
  at.qp.Multiply(at.values, d, Jd);
  EXPECT_LT((Jd - (up.rows - down.rows) / (2 * kStep)).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_NEAR(at.values.gradient.dot(d), (up.cost - down.cost) / (2 * kStep), 1e-6);
  EXPECT_NEAR(at.values.cost, Assess(example.program, example.guess).cost, 1e-12);
}

TEST(ElasticQpTest, ItsSolutionIsASaddlePoint) {
  for (const double nu : {0.1, 10.0, 1000.0}) {
    Subproblem at(KeyPoseChain(4, 7, 0.5));
    constexpr double kLambda = 1e-3;
    ASSERT_TRUE(at.qp.Solve(at.values, at.values.rows, nu, kLambda, 1e-9));
    const VectorXd &d = at.qp.d(), y = at.qp.y();
    VectorXd Hd(d.size()), Jd(y.size());
    at.qp.MultiplyCurvature(at.values, d, Hd);
    at.qp.Multiply(at.values, d, Jd);
    // Stationary in d, against any direction.
    Random random(3);
    for (int i = 0; i < 10; ++i) {
      VectorXd v(d.size()), Jv(y.size());
      for (int k = 0; k < v.size(); ++k) v[k] = random.Normal();
      at.qp.Multiply(at.values, v, Jv);
      EXPECT_NEAR((at.values.gradient + Hd + kLambda * d).dot(v) + y.dot(Jv), 0, 1e-6 * v.norm());
    }
    // The largest in y.
    for (int i = 0; i < y.size(); ++i) {
      const double row = at.values.rows[i] + Jd[i], lowest = at.view.is_equality(i) ? -nu : 0;
      EXPECT_GE(y[i], lowest - 1e-9);
      EXPECT_LE(y[i], nu + 1e-9);
      EXPECT_LT(row > 0 ? row * (nu - y[i]) : -row * (y[i] - lowest), 1e-6);
    }
  }
}

TEST(NativeTest, AsCheapAsIpoptOnChains) {
  TETHER_NEEDS_PLUGIN("ipopt");
  // The chains have several local optima, and two methods need not end in the same one.
  int as_cheap = 0, compared = 0;
  for (const double turn : {0.1, 0.5, 1.0}) {
    for (uint64_t seed = 1; seed <= 5; ++seed) {
      Example example = KeyPoseChain(6, seed, turn);
      const Result native = MakeSolver(Backend::kNative)->Solve(example.program, example.guess, Options());
      const Result ipopt = MakeSolver(Backend::kIpopt)->Solve(example.program, example.guess, Options());
      ASSERT_TRUE(native.ok()) << native.Summary();
      EXPECT_LT(native.max_violation_m + native.max_violation_rad, 1e-6);
      if (!ipopt.ok()) continue;
      ++compared;
      as_cheap += native.cost < 1.005 * ipopt.cost ? 1 : 0;
      example.guess = ipopt.x;
      const Result again = MakeSolver(Backend::kNative)->Solve(example.program, example.guess, Options());
      ASSERT_TRUE(again.ok()) << again.Summary();
      EXPECT_LT(again.cost, 1.001 * ipopt.cost) << "turn " << turn << ", seed " << seed;
    }
  }
  EXPECT_GE(compared, 12);
  EXPECT_GE(as_cheap, compared - 4);
}

/// The nearest point with max(x₁, x₂, …) ≤ 0: a kink where only one branch at a time has a derivative.
TEST(NativeTest, ConvergesInAKink) {
  Example example;
  constexpr int kSize = 4;
  const VectorXd free = VectorXd::Constant(kSize, std::numeric_limits<double>::infinity());
  const BlockRef x = example.program.AddVector("x", -free, free);
  const Eigen::Vector4d target(1.0, 0.9, 1.1, 0.7);
  example.guess.vectors.push_back(Eigen::Vector4d(-1, -1, -1, -1));
  example.program.Add(VectorResidual(
                          "distance", kSize, x, [=](const VectorXd& v) -> VectorXd { return v - target; },
                          [](const VectorXd&) -> MatrixXd { return Eigen::Matrix4d::Identity(); }),
                      Role::kCost);
  example.program.Add(
      VectorResidual(
          "largest", 1, x, [](const VectorXd& v) -> VectorXd { return VectorXd::Constant(1, v.maxCoeff()); },
          [](const VectorXd& v) -> MatrixXd {
            int largest = 0;
            v.maxCoeff(&largest);
            return MatrixXd(Eigen::RowVector4d::Unit(largest));
          }),
      Role::kInequality);
  const Result result = MakeSolver(Backend::kNative)->Solve(example.program, example.guess, Options());
  ASSERT_TRUE(result.ok()) << result.Summary();
  EXPECT_NEAR(result.cost, target.squaredNorm(), 1e-4);
  EXPECT_LT(result.iterations, 20) << result.Summary();
}

TEST(NativeTest, StepsBackFromWhereAResidualIsNotFinite) {
  // ‖(3 + log x, x)‖² has no value beyond zero, where a full step from 2 leads.
  Example example;
  const VectorXd free = VectorXd::Constant(1, std::numeric_limits<double>::infinity());
  const BlockRef x = example.program.AddVector("x", -free, free);
  example.guess.vectors.push_back(VectorXd::Constant(1, 2.0));
  example.program.Add(
      VectorResidual(
          "log", 1, x,
          [](const VectorXd& v) -> VectorXd { return VectorXd::Constant(1, 3 + std::log(v[0])); },
          [](const VectorXd& v) -> MatrixXd { return MatrixXd::Constant(1, 1, 1 / v[0]); }),
      Role::kCost);
  const Result result = MakeSolver(Backend::kNative)->Solve(example.program, example.guess, Options());
  ASSERT_TRUE(result.ok()) << result.Summary();
  EXPECT_NEAR(result.x.vectors[0][0], std::exp(-3), 1e-6);
}

TEST(NativeTest, SolvesLongChains) {
  const Example example = KeyPoseChain(60, 1);
  const Result result = MakeSolver(Backend::kNative)->Solve(example.program, example.guess, Options());
  ASSERT_TRUE(result.ok()) << result.Summary();
  EXPECT_LT(result.iterations, 60);
}

TEST(NativeTest, NamesTheTermsThatFightAndNoOthers) {
  // Two tables at different heights, a wall that is far away, a floor that is touched but does not conflict.
  Example example;
  const BlockRef box = example.program.AddPose("box");
  example.guess.poses.push_back(Pose(Vector3d(0.1, 0, 0.5)));
  const Vector3d x = Vector3d::UnitX(), z = Vector3d::UnitZ();
  example.program.Add(PoseToTarget(box, Pose(Vector3d(0.3, 0, 0.3)), 1, 1), Role::kCost);
  example.program.Add(PlaneDistance(box, Vector3d::Zero(), x, 0.1), Role::kInequality);
  example.program.Add(PlaneDistance(box, Vector3d::Zero(), z, 0.2), Role::kEquality);
  example.program.Add(Upright(box), Role::kEquality);
  example.program.Add(PlaneDistance(box, Vector3d::Zero(), z, 0.4), Role::kEquality);
  example.program.Add(OutsideBall(box, Vector3d(0, 0, 2), 0.5), Role::kInequality);
  const Result result = MakeSolver(Backend::kNative)->Solve(example.program, example.guess, Options());
  EXPECT_EQ(result.status, Status::kLocallyInfeasible) << result.Summary();
  ASSERT_EQ(result.blocking_terms.size(), 2u);
  EXPECT_EQ(std::min(result.blocking_terms[0], result.blocking_terms[1]), 2);
  EXPECT_EQ(std::max(result.blocking_terms[0], result.blocking_terms[1]), 4);
}

TEST(NativeTest, AnInequalityThatHoldsButConflictsIsNamed) {
  // The equality is violated for the two inequalities, whose multipliers together are larger; all of them
  // conflict.
  Example example;
  const BlockRef box = example.program.AddPose("box");
  example.guess.poses.push_back(Pose());
  const Vector3d x = Vector3d::UnitX();
  example.program.Add(PoseToTarget(box, Pose(), 1, 1), Role::kCost);
  example.program.Add(PlaneDistance(box, Vector3d::Zero(), x, 0.2), Role::kEquality);
  example.program.Add(PlaneDistance(box, Vector3d::Zero(), 2 * x, 0.2), Role::kInequality);
  const Result result = MakeSolver(Backend::kNative)->Solve(example.program, example.guess, Options());
  EXPECT_EQ(result.status, Status::kLocallyInfeasible) << result.Summary();
  EXPECT_NEAR(result.x.poses[0].p.x(), 0.1, 1e-6);
  EXPECT_EQ(result.blocking_terms, (std::vector<int>{1, 2}));
}

TEST(NativeTest, MultipliersBalanceTheCost) {
  const Example example = KeyPoseChain(4, 3, 0.5);
  const Result result = MakeSolver(Backend::kNative)->Solve(example.program, example.guess, Options());
  ASSERT_TRUE(result.ok()) << result.Summary();
  EXPECT_TRUE(result.blocking_terms.empty());
  const Program& program = example.program;
  ASSERT_EQ(result.warm_start.terms.size(), program.terms().size());
  VectorXd gradient = VectorXd::Zero(program.num_variables());
  for (size_t k = 0; k < program.terms().size(); ++k) {
    const Residual& residual = *program.terms()[k].residual;
    VectorXd r(residual.size());
    MatrixXd J(residual.size(), 6 * static_cast<Eigen::Index>(residual.blocks().size()));
    JacobianRef ref(J);
    residual.Evaluate(result.x, r, &ref);
    const VectorXd y = program.terms()[k].role == Role::kCost ? VectorXd(2 * r) : result.warm_start.terms[k];
    ASSERT_EQ(y.size(), r.size());
    for (size_t b = 0; b < residual.blocks().size(); ++b) {
      gradient.segment<6>(program.Offset(residual.blocks()[b])) +=
          J.middleCols<6>(6 * static_cast<Eigen::Index>(b)).transpose() * y;
    }
  }
  EXPECT_LT(gradient.cwiseAbs().maxCoeff(), 1e-3);
}

TEST(NativeTest, StartsWarm) {
  int cold_iterations = 0, warm_iterations = 0;
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const Example example = KeyPoseChain(14, seed);
    const auto solver = MakeSolver(Backend::kNative);
    const Result first = solver->Solve(example.program, example.guess, Options());
    ASSERT_TRUE(first.ok()) << first.Summary();
    const Result again = solver->Solve(example.program, first.x, Options(), &first.warm_start);
    ASSERT_TRUE(again.ok()) << again.Summary();
    EXPECT_LE(again.iterations, 1);
    EXPECT_NEAR(again.cost, first.cost, 1e-6 * (1 + first.cost));
    // The last box has to move.
    Example moved = KeyPoseChain(14, seed);
    Program& program = moved.program;
    program.Add(PlaneDistance({BlockRef::Kind::kPose, 27}, Vector3d::Zero(), Vector3d::UnitX(),
                              first.x.poses[27].p.x() - 0.02),
                Role::kInequality);
    // From the same point, so that both end in the same optimum of several.
    const Result cold = solver->Solve(program, first.x, Options());
    const Result warm = solver->Solve(program, first.x, Options(), &first.warm_start);
    ASSERT_TRUE(cold.ok() && warm.ok()) << cold.Summary() << "; " << warm.Summary();
    EXPECT_LT(warm.cost, 1.01 * cold.cost);
    cold_iterations += cold.iterations;
    warm_iterations += warm.iterations;
  }
  EXPECT_LE(warm_iterations, cold_iterations);
}

TEST(NativeTest, WarmStartsOfOtherProgramsDoNoHarm) {
  const Example example = KeyPoseChain(4, 1);
  const auto solver = MakeSolver(Backend::kNative);
  WarmStart warm = solver->Solve(KeyPoseChain(3, 2).program, KeyPoseChain(3, 2).guess, Options()).warm_start;
  warm.terms[2] = VectorXd::Constant(2, std::nan(""));
  warm.terms.resize(200, VectorXd::Ones(17));
  warm.penalty = 1e300;
  const Result result = solver->Solve(example.program, example.guess, Options(), &warm);
  ASSERT_TRUE(result.ok()) << result.Summary();
  EXPECT_LT(result.max_violation_m + result.max_violation_rad, 1e-6);
}

TEST(NativeTest, TellsWhereTheTimeWent) {
  TETHER_NEEDS_PLUGIN("ipopt");
  TETHER_NEEDS_PLUGIN("nlopt");
  const Example example = KeyPoseChain(14, 1);
  for (const Backend backend : {Backend::kNative, Backend::kIpopt, Backend::kNlopt}) {
    Options options;
    options.max_iterations = 20;
    const Result result = MakeSolver(backend)->Solve(example.program, example.guess, options);
    EXPECT_GT(result.evaluation_s, 0);
    EXPECT_EQ(result.assembly_s > 0 && result.linear_algebra_s > 0, backend == Backend::kNative);
    EXPECT_LE(result.evaluation_s + result.assembly_s + result.linear_algebra_s, result.solve_s);
  }
}

#ifdef TETHER_COUNTS_ALLOCATIONS
TEST(NativeTest, IterationsDoNotAllocate) {
  Example example = KeyPoseChain(5, 1, 0.5);
  std::vector<long> counts;
  counts.reserve(1000);
  example.program.Add(MakeResidual("probe", 1, Unit::kNone, {{BlockRef::Kind::kPose, 0}},
                                   [&counts](const Point&, VectorRef r, JacobianRef* J) {
                                     counts.push_back(heap_allocations);
                                     r[0] = 0;
                                     if (J != nullptr) J->setZero();
                                   }),
                      Role::kCost);
  heap_allocations = 0;
  const Result result = MakeSolver(Backend::kNative)->Solve(example.program, example.guess, Options());
  ASSERT_TRUE(result.ok()) << result.Summary();
  ASSERT_GT(counts.size(), 5);
  EXPECT_GT(counts.front(), 0);
  // The last evaluation belongs to the verdict.
  EXPECT_EQ(counts[counts.size() - 2], counts.front());
}
#endif

}  // namespace
}  // namespace tether::nlp
