#include "tether/nlp/program.h"

#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "testing/nlp/test_programs.h"
#include "tether/math/numeric_derivative.h"
#include "tether/nlp/vector_view.h"

namespace tether::nlp {
namespace {

using namespace testing;  // NOLINT

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Chart coordinates at zero, near it, random, near π and between π and 2π.
std::vector<math::Vector6d> ChartPoints() {
  Random random(3);
  std::vector<math::Vector6d> all{math::Vector6d::Zero()};
  for (double angle : {1e-8, 1e-4, 0.3, 1.5, std::numbers::pi - 1e-6, std::numbers::pi, 5.0}) {
    for (int i = 0; i < 10; ++i) {
      math::Vector6d v;
      v << RandomVector(random, 1), angle * RandomVector(random, 1).normalized();
      all.push_back(v);
    }
  }
  return all;
}

TEST(ChartTest, ZeroIsTheOrigin) {
  Random random(1);
  const Pose X = RandomPose(random);
  EXPECT_EQ((ChartPose(X, math::Vector6d::Zero()).R - X.R).norm(), 0);
  EXPECT_EQ((ChartPose(X, math::Vector6d::Zero()).p - X.p).norm(), 0);
}

TEST(ChartTest, JacobianAgreesWithNumericDifferentiation) {
  Random random(2);
  for (const math::Vector6d& v : ChartPoints()) {
    const Pose origin = RandomPose(random);
    const Pose X = ChartPose(origin, v);
    // The right perturbation δ that leads from X(v) to X(v + dv).
    const MatrixXd numeric = math::NumericJacobian(
        [&](const VectorXd& dv) -> VectorXd {
          return math::LogSE3(math::Between(X, ChartPose(origin, v + math::Vector6d(dv))));
        },
        VectorXd::Zero(6));
    EXPECT_LT((numeric - ChartJacobian(origin, v)).norm(), 1e-9) << v.transpose();
  }
}

TEST(VectorViewTest, DerivativesAgreeWithNumericDifferentiation) {
  Random random(4);
  Example example = KeyPoseChain(3, 7);
  const BlockRef q =
      example.program.AddVector("q", VectorXd::Constant(2, -1), VectorXd::Constant(2, kInfinity));
  example.guess.vectors.push_back(VectorXd::Constant(2, 0.3));
  example.program.Add(VectorResidual(
                          "square", 2, q, [](const VectorXd& v) -> VectorXd { return v.cwiseProduct(v); },
                          [](const VectorXd& v) -> MatrixXd { return 2 * MatrixXd(v.asDiagonal()); }),
                      Role::kCost);
  VectorView view(example.program, example.guess);
  const int n = view.num_variables();
  ASSERT_EQ(n, 38);
  for (double scale : {0.0, 1e-8, 0.2}) {
    VectorXd x = view.start();
    for (int i = 0; i < n; ++i) x[i] += scale * random.Normal();
    const MatrixXd numeric = math::NumericJacobian(
        [&](const VectorXd& y) -> VectorXd {
          EXPECT_TRUE(view.EvaluateValues(y));
          VectorXd all(1 + view.num_constraints());
          all << view.cost(), view.constraints();
          return all;
        },
        x);
    ASSERT_TRUE(view.EvaluateDerivatives(x));
    MatrixXd J = MatrixXd::Zero(view.num_constraints(), n);
    for (size_t k = 0; k < view.jacobian_values().size(); ++k) {
      J(view.jacobian_entries()[k].row, view.jacobian_entries()[k].column) += view.jacobian_values()[k];
    }
    EXPECT_LT((numeric.row(0).transpose() - view.gradient()).norm(), 1e-7);
    EXPECT_LT((numeric.bottomRows(view.num_constraints()) - J).norm(), 1e-7);
  }
}

TEST(VectorViewTest, GaussNewtonIsTheHessianOfLinearLeastSquares) {
  Program program;
  const BlockRef a =
      program.AddVector("a", VectorXd::Constant(2, -kInfinity), VectorXd::Constant(2, kInfinity));
  const BlockRef b =
      program.AddVector("b", VectorXd::Constant(3, -kInfinity), VectorXd::Constant(3, kInfinity));
  Random random(5);
  MatrixXd A(4, 5);
  for (int k = 0; k < A.size(); ++k) A(k) = random.Normal();
  // Blocks in the other order than their coordinates.
  program.Add(MakeResidual("linear", 4, Unit::kNone, {b, a},
                           [A](const Point& x, VectorRef r, JacobianRef* J) {
                             r = A.leftCols<3>() * x.vectors[1] + A.rightCols<2>() * x.vectors[0];
                             if (J != nullptr) *J = A;
                           }),
              Role::kCost);
  VectorView view(program, {{}, {VectorXd::Ones(2), VectorXd::Ones(3)}});
  ASSERT_TRUE(view.EvaluateDerivatives(view.start()));
  MatrixXd H = MatrixXd::Zero(5, 5);
  for (size_t k = 0; k < view.hessian_values().size(); ++k) {
    const auto [row, column] = view.hessian_entries()[k];
    EXPECT_GE(row, column);
    H(row, column) += view.hessian_values()[k];
    if (row != column) H(column, row) += view.hessian_values()[k];
  }
  MatrixXd ordered(4, 5);
  ordered << A.rightCols<2>(), A.leftCols<3>();
  EXPECT_LT((H - 2 * ordered.transpose() * ordered).norm(), 1e-12);
}

TEST(ProgramTest, CountsVariablesAndRows) {
  const Example example = KeyPoseChain(4, 1);
  const Program& program = example.program;
  EXPECT_EQ(program.num_poses(), 8);
  EXPECT_EQ(program.num_variables(), 48);
  EXPECT_EQ(program.num_rows(Role::kCost), 3 * 12);
  EXPECT_EQ(program.num_rows(Role::kEquality), 6 + 4 * 3 + 2 * 5);
  EXPECT_EQ(program.Offset({BlockRef::Kind::kPose, 3}), 18);
  EXPECT_EQ(program.name({BlockRef::Kind::kPose, 2}), "hand1");
}

TEST(ProgramTest, ResidualsOfTheTestsHaveExactJacobians) {
  Random random(6);
  const Example example = KeyPoseChain(4, 1);
  for (int i = 0; i < 10; ++i) {
    VectorXd delta(example.program.num_variables());
    for (int k = 0; k < delta.size(); ++k) delta[k] = 0.3 * random.Normal();
    const Point x = Retract(example.guess, delta);
    for (const Term& term : example.program.terms()) {
      EXPECT_LT(JacobianError(*term.residual, example.program, x), 1e-8) << term.residual->name();
    }
  }
}

TEST(ProgramTest, JacobianErrorFindsAWrongEntryAndAnUnwrittenOne) {
  Program program;
  const BlockRef pose = program.AddPose("a");
  const auto wrong = [&](int row, double factor) {
    return MakeResidual("wrong", 6, Unit::kNone, {pose}, [=](const Point& x, VectorRef r, JacobianRef* J) {
      PoseToTarget(pose, Pose(), 1, 1)->Evaluate(x, r, J);
      if (J != nullptr) J->row(row) *= factor;
    });
  };
  const Point x{{Pose(Vector3d(1, 2, 3))}, {}};
  EXPECT_LT(JacobianError(*wrong(2, 1), program, x), 1e-9);
  EXPECT_NEAR(JacobianError(*wrong(2, 1.01), program, x), 0.01, 1e-8);
  EXPECT_EQ(JacobianError(*wrong(2, std::nan("")), program, x), kInfinity);
}

TEST(AssessTest, ReportsViolationsByUnitLargestFirst) {
  Program program;
  const BlockRef pose = program.AddPose("a");
  const BlockRef q = program.AddVector("q", VectorXd::Zero(1), VectorXd::Ones(1));
  program.Add(PlaneDistance(pose, Vector3d::Zero(), Vector3d::UnitZ(), 0.5), Role::kInequality);
  program.Add(PlaneDistance(pose, Vector3d::Zero(), Vector3d::UnitX(), 0.5), Role::kInequality);
  program.Add(Upright(pose), Role::kEquality);
  program.Add(PoseToTarget(pose, Pose(), 2, 0), Role::kCost);
  const Point x{{Pose(math::ExpSO3(Vector3d(0.1, 0, 0)), Vector3d(0, 0, 0.7))},
                {VectorXd::Constant(1, 1.25)}};
  const Assessment result = Assess(program, x);
  EXPECT_NEAR(result.cost, 4 * 0.49, 1e-12);
  EXPECT_NEAR(result.max_violation_m, 0.2, 1e-12);
  EXPECT_NEAR(result.max_violation_rad, std::sin(0.1), 1e-12);
  EXPECT_NEAR(result.max_bound_violation, 0.25, 1e-12);
  EXPECT_TRUE(result.finite);
  ASSERT_EQ(result.violations.size(), 2);
  EXPECT_EQ(result.violations[0].residual->name(), "plane");
  EXPECT_EQ(result.violations[1].residual->name(), "upright");
  EXPECT_EQ(result.violations[1].row, 1);
  static_cast<void>(q);
}

TEST(AssessTest, NamesTheResidualThatIsNotFinite) {
  Program program;
  const BlockRef pose = program.AddPose("a");
  program.Add(MakeResidual("place(hook, shelf)", 1, Unit::kMetre, {pose},
                           [](const Point&, VectorRef r, JacobianRef*) { r[0] = std::nan(""); }),
              Role::kEquality);
  const Assessment result = Assess(program, {{Pose()}, {}});
  EXPECT_FALSE(result.finite);
  EXPECT_EQ(result.not_finite, "place(hook, shelf)");
}

}  // namespace
}  // namespace tether::nlp
