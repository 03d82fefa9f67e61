#include "tether/nlp/solver.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/QR>

#include "testing/common/needs_plugin.h"
#include "testing/nlp/test_programs.h"
#include "tether/common/error.h"
#include "tether/math/numeric_derivative.h"

namespace tether::nlp {
namespace {

using namespace testing;  // NOLINT
using ::testing::HasSubstr;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Options Patient() {
  Options options;
  options.max_iterations = 5000;
  return options;
}

VectorXd Stack(const Program& program, const Point& x, Role role) {
  VectorXd all(program.num_rows(role));
  int row = 0;
  for (const Term& term : program.terms()) {
    if (term.role != role) continue;
    const int size = term.residual->size();
    term.residual->Evaluate(x, all.segment(row, size), nullptr);
    row += size;
  }
  return all;
}

/// How far the gradient of the cost at x is from the cone that the active constraints span, by numeric
/// differentiation and non-negative least squares through projected gradients: zero at a KKT point. Bounds
/// are ignored.
double KktResidual(const Program& program, const Point& x) {
  const auto jacobian = [&](Role role) {
    return math::NumericJacobian(
        [&](const VectorXd& delta) { return Stack(program, Retract(x, delta), role); },
        VectorXd::Zero(program.num_variables()));
  };
  const VectorXd gradient = 2 * jacobian(Role::kCost).transpose() * Stack(program, x, Role::kCost);
  const MatrixXd E = jacobian(Role::kEquality);
  const MatrixXd I = jacobian(Role::kInequality);
  const VectorXd values = Stack(program, x, Role::kInequality);
  MatrixXd active(E.rows() + I.rows(), E.cols());
  int rows = static_cast<int>(E.rows());
  active.topRows(rows) = E;
  for (int k = 0; k < values.size(); ++k) {
    if (values[k] > -1e-4) active.row(rows++) = I.row(k);
  }
  active.conservativeResize(rows, Eigen::NoChange);
  if (rows == 0) return gradient.norm();
  VectorXd multipliers = VectorXd::Zero(rows);
  const double step = 1 / (active * active.transpose()).norm();
  for (int i = 0; i < 200000; ++i) {
    const VectorXd slope = active * (gradient + active.transpose() * multipliers);
    multipliers -= step * slope;
    for (int k = static_cast<int>(E.rows()); k < rows; ++k) multipliers[k] = std::max(0.0, multipliers[k]);
    if (slope.norm() < 1e-12) break;
  }
  return (gradient + active.transpose() * multipliers).norm();
}

/// Laws that every backend keeps.
class SolverConformance : public ::testing::TestWithParam<Backend> {
 protected:
  void SetUp() override {
    if (GetParam() != Backend::kNative) TETHER_NEEDS_PLUGIN(ToString(GetParam()));
  }
  Result Solve(const Example& example, const Options& options = Patient()) const {
    return MakeSolver(GetParam())->Solve(example.program, example.guess, options);
  }

  static Example OneVector(const VectorXd& guess, double lower = -kInfinity, double upper = kInfinity) {
    Example example;
    const int n = static_cast<int>(guess.size());
    example.program.AddVector("x", VectorXd::Constant(n, lower), VectorXd::Constant(n, upper));
    example.guess.vectors.push_back(guess);
    return example;
  }
  static constexpr BlockRef kVector{BlockRef::Kind::kVector, 0};
  static constexpr BlockRef kPose{BlockRef::Kind::kPose, 0};
};

TEST_P(SolverConformance, MeanOfTwoPosesIsTheMidpoint) {
  Random random(1);
  for (int i = 0; i < 5; ++i) {
    const Pose A = RandomPose(random);
    const Pose B =
        A * Pose(math::ExpSO3(2.5 * RandomVector(random, 1).normalized()), RandomVector(random, 1));
    Example example;
    example.program.AddPose("X");
    example.guess.poses.push_back(Pose(A.R * math::ExpSO3(RandomVector(random, 0.2)), B.p));
    example.program.Add(PoseToTarget(kPose, A, 1, 1), Role::kCost);
    example.program.Add(PoseToTarget(kPose, B, 1, 1), Role::kCost);
    const Result result = Solve(example);
    ASSERT_TRUE(result.ok()) << result.Summary();
    EXPECT_LT((result.x.poses[0].p - (A.p + B.p) / 2).norm(), 1e-5);
    const Matrix3d middle = A.R * math::ExpSO3(0.5 * math::LogSO3(A.R.transpose() * B.R));
    EXPECT_LT(math::AngleBetween(result.x.poses[0].R, middle), 1e-5);
    EXPECT_LT((result.x.poses[0].R.transpose() * result.x.poses[0].R - Matrix3d::Identity()).norm(), 1e-12);
  }
}

TEST_P(SolverConformance, NearestPointOfAHalfSpace) {
  const Pose target(math::ExpSO3(Vector3d(0.3, -0.2, 0.5)), Vector3d(0.2, 0.1, -0.4));
  Example example;
  example.program.AddPose("X");
  example.guess.poses.push_back(Pose(Vector3d(0, 0, 1)));
  example.program.Add(PoseToTarget(kPose, target, 1, 1), Role::kCost);
  const Vector3d n = Vector3d(1, 2, -2) / 3;
  // n · p ≤ −0.5, while the target has n · p = 0.4.
  example.program.Add(PlaneDistance(kPose, Vector3d::Zero(), n, -0.5), Role::kInequality);
  const Result result = Solve(example);
  ASSERT_TRUE(result.ok()) << result.Summary();
  EXPECT_LT((result.x.poses[0].p - (target.p - (n.dot(target.p) + 0.5) * n)).norm(), 1e-5);
  EXPECT_LT(math::AngleBetween(result.x.poses[0].R, target.R), 1e-5);
  EXPECT_NEAR(result.cost, std::pow(n.dot(target.p) + 0.5, 2), 1e-5);
}

TEST_P(SolverConformance, NearestPointOutsideABall) {
  const Vector3d centre(0.1, 0.2, 0.3), wanted(0.2, 0.2, 0.25);
  Example example;
  example.program.AddPose("X");
  example.guess.poses.push_back(Pose(Vector3d(1, 0, 0)));
  example.program.Add(PoseToTarget(kPose, Pose(wanted), 1, 1), Role::kCost);
  example.program.Add(OutsideBall(kPose, centre, 0.5), Role::kInequality);
  const Result result = Solve(example);
  ASSERT_TRUE(result.ok()) << result.Summary();
  EXPECT_LT((result.x.poses[0].p - (centre + 0.5 * (wanted - centre).normalized())).norm(), 1e-4);
}

TEST_P(SolverConformance, UprightKeepsTheNearestYaw) {
  // Among rotations about z, the nearest to Rz(0.7) Rx(0.4) is Rz(0.7).
  const Pose target(math::ExpSO3(Vector3d(0, 0, 0.7)) * math::ExpSO3(Vector3d(0.4, 0, 0)), Vector3d(1, 2, 3));
  Example example;
  example.program.AddPose("X");
  example.guess.poses.push_back(Pose(math::ExpSO3(Vector3d(0.2, 0.3, -0.4)), Vector3d::Zero()));
  example.program.Add(PoseToTarget(kPose, target, 1, 1), Role::kCost);
  example.program.Add(Upright(kPose), Role::kEquality);
  const Result result = Solve(example);
  ASSERT_TRUE(result.ok()) << result.Summary();
  EXPECT_LT(math::AngleBetween(result.x.poses[0].R, math::ExpSO3(Vector3d(0, 0, 0.7))), 1e-5);
  EXPECT_NEAR(result.cost, 0.16, 1e-6);
}

TEST_P(SolverConformance, APoseThatEqualitiesDetermine) {
  const Pose target(math::ExpSO3(Vector3d(0.3, 1.2, -0.6)), Vector3d(1, -2, 0.5));
  Example example;
  example.program.AddPose("X");
  example.guess.poses.push_back(Pose());
  example.program.Add(PoseToTarget(kPose, target, 1, 1, Unit::kMetre), Role::kEquality);
  example.program.Add(PoseToTarget(kPose, Pose(), 1, 1), Role::kCost);
  const Result result = Solve(example);
  ASSERT_TRUE(result.ok()) << result.Summary();
  EXPECT_LT((result.x.poses[0].p - target.p).norm(), 1e-5);
  EXPECT_LT(math::AngleBetween(result.x.poses[0].R, target.R), 1e-5);
}

TEST_P(SolverConformance, RedundantEqualitiesMoreThanVariables) {
  const Pose target(math::ExpSO3(Vector3d(0.1, 0.2, 0)), Vector3d(1, -2, 0.5));
  Example example;
  example.program.AddPose("X");
  example.guess.poses.push_back(Pose());
  for (double scale : {1.0, 2.0}) {
    example.program.Add(PoseToTarget(kPose, target, scale, 1, Unit::kMetre), Role::kEquality);
  }
  example.program.Add(PoseToTarget(kPose, Pose(), 1, 1), Role::kCost);
  const Result result = Solve(example);
  ASSERT_TRUE(result.ok()) << result.Summary();
  EXPECT_LT((result.x.poses[0].p - target.p).norm(), 1e-5);
}

// Hock and Schittkowski's test problems whose objectives are sums of squares; the optima are theirs.
TEST_P(SolverConformance, HockSchittkowski1) {
  Example example = OneVector(Eigen::Vector2d(-2, 1));
  example.program.Add(
      VectorResidual(
          "rosenbrock", 2, kVector,
          [](const VectorXd& v) -> VectorXd { return Eigen::Vector2d(10 * (v[1] - v[0] * v[0]), 1 - v[0]); },
          [](const VectorXd& v) -> MatrixXd {
            return Eigen::Matrix2d{{-20 * v[0], 10}, {-1, 0}};
          }),
      Role::kCost);
  const Result result = Solve(example);
  ASSERT_TRUE(result.ok()) << result.Summary();
  EXPECT_LT((result.x.vectors[0] - VectorXd::Ones(2)).norm(), 1e-3);
  EXPECT_NEAR(result.cost, 0, 1e-6);
}

TEST_P(SolverConformance, HockSchittkowski14) {
  // (x₁ − 2)² + (x₂ − 1)², x₁ − 2x₂ + 1 = 0, x₁²/4 + x₂² − 1 ≤ 0: 9 − 2.875 √7.
  Example example = OneVector(Eigen::Vector2d(2, 2));
  example.program.Add(
      VectorResidual(
          "distance", 2, kVector, [](const VectorXd& v) -> VectorXd { return v - Eigen::Vector2d(2, 1); },
          [](const VectorXd&) -> MatrixXd { return Eigen::Matrix2d::Identity(); }),
      Role::kCost);
  example.program.Add(
      VectorResidual(
          "line", 1, kVector,
          [](const VectorXd& v) -> VectorXd { return VectorXd::Constant(1, v[0] - 2 * v[1] + 1); },
          [](const VectorXd&) -> MatrixXd { return Eigen::RowVector2d(1, -2); }),
      Role::kEquality);
  example.program.Add(
      VectorResidual(
          "ellipse", 1, kVector,
          [](const VectorXd& v) -> VectorXd {
            return VectorXd::Constant(1, v[0] * v[0] / 4 + v[1] * v[1] - 1);
          },
          [](const VectorXd& v) -> MatrixXd { return Eigen::RowVector2d(v[0] / 2, 2 * v[1]); }),
      Role::kInequality);
  const Result result = Solve(example);
  ASSERT_TRUE(result.ok()) << result.Summary();
  EXPECT_NEAR(result.cost, 9 - 2.875 * std::sqrt(7), 1e-5);
  EXPECT_LT(KktResidual(example.program, result.x), 1e-3);
}

TEST_P(SolverConformance, HockSchittkowski28) {
  // 28: (x₁+x₂)² + (x₂+x₃)², x₁+2x₂+3x₃ = 1: optimum 0 at (½, −½, ½).
  Example example = OneVector(Vector3d(-4, 1, 1));
  const Eigen::Matrix<double, 2, 3> A{{1, 1, 0}, {0, 1, 1}};
  example.program.Add(VectorResidual(
                          "sums", 2, kVector, [A](const VectorXd& v) -> VectorXd { return A * v; },
                          [A](const VectorXd&) -> MatrixXd { return A; }),
                      Role::kCost);
  example.program.Add(
      VectorResidual(
          "plane", 1, kVector,
          [](const VectorXd& v) -> VectorXd { return VectorXd::Constant(1, v[0] + 2 * v[1] + 3 * v[2] - 1); },
          [](const VectorXd&) -> MatrixXd { return Eigen::RowVector3d(1, 2, 3); }),
      Role::kEquality);
  const Result result = Solve(example);
  ASSERT_TRUE(result.ok()) << result.Summary();
  EXPECT_LT((result.x.vectors[0] - Vector3d(0.5, -0.5, 0.5)).norm(), 1e-3);
}

TEST_P(SolverConformance, BoundsHold) {
  Example example = OneVector(Vector3d(9, 0.5, -9), 0, 1);
  example.program.Add(
      VectorResidual(
          "distance", 3, kVector, [](const VectorXd& v) -> VectorXd { return v - Vector3d(2, 0.25, -1); },
          [](const VectorXd&) -> MatrixXd { return Matrix3d::Identity(); }),
      Role::kCost);
  const Result result = Solve(example);
  ASSERT_TRUE(result.ok()) << result.Summary();
  EXPECT_LT((result.x.vectors[0] - Vector3d(1, 0.25, 0)).norm(), 1e-5);
}

TEST_P(SolverConformance, KeyPoseChainIsAKktPoint) {
  for (uint64_t seed : {1, 2}) {
    const Example example = KeyPoseChain(3, seed);
    const Result result = Solve(example);
    ASSERT_TRUE(result.ok()) << result.Summary();
    EXPECT_LT(result.max_violation_m, 1e-5);
    EXPECT_LT(result.max_violation_rad, 1e-5);
    EXPECT_LT(KktResidual(example.program, result.x), 5e-3);
    EXPECT_GT(KktResidual(example.program, example.guess), 0.1);
  }
}

TEST_P(SolverConformance, StartingAtTheSolutionStaysThere) {
  Example example = KeyPoseChain(2, 3);
  const Result first = Solve(example);
  ASSERT_TRUE(first.ok()) << first.Summary();
  example.guess = first.x;
  const Result again = Solve(example);
  ASSERT_TRUE(again.ok()) << again.Summary();
  // An augmented Lagrangian starts from zero multipliers and may leave for a better optimum.
  EXPECT_LE(again.cost, first.cost + 1e-4);
  if (GetParam() != Backend::kNlopt) {
    EXPECT_NEAR(again.cost, first.cost, 1e-4);
  }
}

TEST_P(SolverConformance, ContradictionIsNeverSolved) {
  Example example;
  example.program.AddPose("X");
  example.guess.poses.push_back(Pose());
  example.program.Add(PlaneDistance(kPose, Vector3d::Zero(), Vector3d::UnitZ(), -0.1), Role::kInequality);
  example.program.Add(PlaneDistance(kPose, Vector3d::Zero(), -Vector3d::UnitZ(), -0.1), Role::kInequality);
  example.program.Add(PoseToTarget(kPose, Pose(), 1, 1), Role::kCost);
  Options options;
  options.time_limit_s = 2;
  const Result result = Solve(example, options);
  EXPECT_FALSE(result.ok());
  EXPECT_GE(result.max_violation_m, 0.1 - 1e-9);
  if (GetParam() != Backend::kNlopt) {
    EXPECT_EQ(result.status, Status::kLocallyInfeasible) << result.Summary();
  }
}

TEST_P(SolverConformance, NothingToSolve) {
  const Example empty;
  EXPECT_TRUE(Solve(empty).ok());
  Example fixed = OneVector(Vector3d::Zero(), 1, 1);
  fixed.program.Add(
      VectorResidual(
          "sum", 1, kVector, [](const VectorXd& v) -> VectorXd { return VectorXd::Constant(1, v.sum() - 3); },
          [](const VectorXd&) -> MatrixXd { return Eigen::RowVector3d::Ones(); }),
      Role::kEquality);
  EXPECT_TRUE(Solve(fixed).ok());
  Example wrong = OneVector(Vector3d::Zero(), 1, 1);
  wrong.program.Add(
      VectorResidual(
          "sum", 1, kVector, [](const VectorXd& v) -> VectorXd { return VectorXd::Constant(1, v.sum() - 2); },
          [](const VectorXd&) -> MatrixXd { return Eigen::RowVector3d::Ones(); }),
      Role::kEquality);
  const Result result = Solve(wrong);
  EXPECT_EQ(result.status, Status::kLocallyInfeasible);
  EXPECT_NEAR(result.max_violation_m, 1, 1e-12);
}

TEST_P(SolverConformance, NoCostAtAll) {
  Example example;
  example.program.AddPose("X");
  example.guess.poses.push_back(Pose());
  example.program.Add(PlaneDistance(kPose, Vector3d::Zero(), Vector3d::UnitZ(), -0.5), Role::kEquality);
  const Result result = Solve(example);
  ASSERT_TRUE(result.ok()) << result.Summary();
  EXPECT_NEAR(result.x.poses[0].p.z(), -0.5, 1e-5);
}

TEST_P(SolverConformance, NamesTheResidualThatIsNotFinite) {
  for (bool in_jacobian : {false, true}) {
    Example example = KeyPoseChain(2, 1);
    example.program.Add(MakeResidual("place(hook, shelf)", 1, Unit::kMetre, {kPose},
                                     [in_jacobian](const Point&, VectorRef r, JacobianRef* J) {
                                       r[0] = in_jacobian ? 0 : std::nan("");
                                       if (J != nullptr) J->setConstant(std::nan(""));
                                     }),
                        Role::kEquality);
    const Result result = Solve(example);
    EXPECT_EQ(result.status, Status::kFailed);
    EXPECT_EQ(result.message, "residual 'place(hook, shelf)' is not finite");
  }
}

TEST_P(SolverConformance, IterationLimit) {
  Options options;
  options.max_iterations = 3;
  options.trace = true;
  const Result result = Solve(KeyPoseChain(5, 1), options);
  EXPECT_EQ(result.status, Status::kIterationLimit) << result.Summary();
  EXPECT_LE(result.iterations, 3);
  EXPECT_THAT(result.Summary(), HasSubstr("iteration limit: cost"));
}

/// A chain whose evaluation is slow, so that a short limit ends it on any machine; `during` runs in each
/// evaluation.
Example SlowChain(std::function<void()> during) {
  Example example = KeyPoseChain(6, 1);
  example.program.Add(MakeResidual("slow", 1, Unit::kNone, {{BlockRef::Kind::kPose, 0}},
                                   [during](const Point&, VectorRef r, JacobianRef* J) {
                                     during();
                                     r[0] = 0;
                                     if (J != nullptr) J->setZero();
                                   }),
                      Role::kCost);
  return example;
}

TEST_P(SolverConformance, TimeLimit) {
  Options options = Patient();
  options.time_limit_s = 0.05;
  const Result result =
      Solve(SlowChain([] { std::this_thread::sleep_for(std::chrono::milliseconds(10)); }), options);
  EXPECT_EQ(result.status, Status::kTimeLimit) << result.Summary();
  EXPECT_EQ(result.x.poses.size(), 12);
}

TEST_P(SolverConformance, StopFlag) {
  std::atomic<bool> stop = false;
  Options options = Patient();
  options.stop = &stop;
  int evaluations = 0;
  const Result result = Solve(SlowChain([&] { stop = ++evaluations >= 4; }), options);
  EXPECT_EQ(result.status, Status::kInterrupted) << result.Summary();
  EXPECT_LE(result.evaluations, 5);
}

TEST_P(SolverConformance, TraceCountsIterationsAndEndsNearTheResult) {
  Options options = Patient();
  options.trace = true;
  const Example example = KeyPoseChain(3, 1);
  const Result result = Solve(example, options);
  ASSERT_GT(result.trace.size(), 2);
  for (size_t i = 1; i < result.trace.size(); ++i) {
    EXPECT_GT(result.trace[i].iteration, result.trace[i - 1].iteration);
    EXPECT_GE(result.trace[i].time_s, result.trace[i - 1].time_s);
  }
  const Assessment start = Assess(example.program, example.guess);
  EXPECT_NEAR(result.trace.back().cost, result.cost, 1e-3);
  EXPECT_LT(result.trace.back().violation_m, 1e-3);
  EXPECT_GT(start.max_violation_m, 0.1);
  EXPECT_TRUE(Solve(example).trace.empty());
}

TEST_P(SolverConformance, TheSameTwiceAndFromTwoThreads) {
  const Example example = KeyPoseChain(3, 4);
  Options options = Patient();
  options.max_iterations = 200;
  const Result first = Solve(example, options);
  std::vector<Result> results(4);
  {
    std::vector<std::jthread> threads;
    for (Result& result : results) threads.emplace_back([&] { result = Solve(example, options); });
  }
  for (const Result& result : results) {
    EXPECT_EQ(result.cost, first.cost);
    EXPECT_EQ(result.iterations, first.iterations);
    for (size_t i = 0; i < first.x.poses.size(); ++i) {
      EXPECT_EQ(result.x.poses[i].p, first.x.poses[i].p);
      EXPECT_EQ(result.x.poses[i].R, first.x.poses[i].R);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Backends, SolverConformance,
                         ::testing::Values(Backend::kNative, Backend::kIpopt, Backend::kNlopt),
                         [](const auto& param) { return ToString(param.param); });

TEST(IpoptTest, SolvesLongChains) {
  TETHER_NEEDS_PLUGIN("ipopt");
  for (uint64_t seed : {1, 2, 3}) {
    const Example example = KeyPoseChain(14, seed);
    const Result result = MakeSolver(Backend::kIpopt)->Solve(example.program, example.guess, Options());
    ASSERT_TRUE(result.ok()) << result.Summary();
    EXPECT_LT(result.max_violation_m, 1e-6);
    EXPECT_LT(KktResidual(example.program, result.x), 1e-2);
  }
}

TEST(OptionsTest, NamesTheFieldThatIsOutOfRange) {
  const auto message = [](auto change) -> std::string {
    Options options;
    change(options);
    try {
      options.Validate();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message([](Options&) {}), "");
  EXPECT_THAT(message([](Options& o) { o.max_iterations = 0; }), HasSubstr("max_iterations is 0"));
  EXPECT_THAT(message([](Options& o) { o.time_limit_s = -2; }), HasSubstr("time_limit_s is -2"));
  EXPECT_THAT(message([](Options& o) { o.constraint_tolerance = kInfinity; }),
              HasSubstr("constraint_tolerance is inf"));
  EXPECT_THAT(message([](Options& o) { o.cost_tolerance = std::nan(""); }),
              HasSubstr("cost_tolerance is nan"));
}

TEST(BackendTest, SaysWhetherItIsThere) {
  const auto native = MakeSolver(Backend::kNative);
  EXPECT_TRUE(native->available());
  EXPECT_EQ(native->WhyNot(), "");
  for (const Backend backend : {Backend::kIpopt, Backend::kNlopt}) {
    const auto solver = MakeSolver(backend);
    EXPECT_EQ(solver->available(), HasPlugin(ToString(backend)));
    EXPECT_EQ(solver->WhyNot().empty(), solver->available());
  }
}

TEST(BackendTest, NamesReadBack) {
  for (Backend backend : {Backend::kNative, Backend::kIpopt, Backend::kNlopt})
    EXPECT_EQ(ParseBackend(ToString(backend)), backend);
  try {
    ParseBackend("ipop");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("unknown solver 'ipop'; did you mean 'ipopt'?"));
    EXPECT_THAT(error.what(), HasSubstr("native, ipopt or nlopt"));
  }
}

TEST(ResultTest, Summary) {
  EXPECT_EQ(Result().Summary(), "not called");
  Result result;
  result.status = Status::kFailed;
  result.message = "why";
  result.max_violation_m = 0.002;
  EXPECT_EQ(result.Summary(),
            "failed: cost 0, violation 2 mm, 0 mrad, 0 iterations, 0 evaluations, 0.000 s (why)");
}

}  // namespace
}  // namespace tether::nlp
