#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "testing/nlp/test_programs.h"
#include "tether/nlp/native/elastic_qp.h"
#include "tether/nlp/native/manifold_view.h"
#include "tether/nlp/solver.h"

/// The purpose of each part of a step of the native solver: the careful subproblem, the bound on turns, the
/// second-order correction, cuts that move along and are dropped in time.
namespace tether::nlp {
namespace {

using namespace testing;  // NOLINT

Result SolveNatively(const Example& example) {
  return MakeSolver(Backend::kNative)->Solve(example.program, example.guess, Options());
}

/// The nearest point to a random target in ℝⁿ, from a random guess.
struct Nearest : Example {
  Nearest(int dim, Random& random, double guess_scale) {
    const VectorXd free = VectorXd::Constant(dim, std::numeric_limits<double>::infinity());
    x = program.AddVector("x", -free, free);
    const VectorXd target = Draw(dim, random);
    guess.vectors.push_back(guess_scale * Draw(dim, random));
    program.Add(VectorResidual(
                    "distance", dim, x, [=](const VectorXd& v) -> VectorXd { return v - target; },
                    [=](const VectorXd&) -> MatrixXd { return MatrixXd::Identity(dim, dim); }),
                Role::kCost);
  }
  static VectorXd Draw(int dim, Random& random) {
    VectorXd v(dim);
    for (double& entry : v) entry = random.Normal();
    return v;
  }
  /// value(v) = 0, or ≤ 0.
  void AddRow(Role role, std::function<double(const VectorXd&)> value,
              std::function<VectorXd(const VectorXd&)> gradient) {
    program.Add(VectorResidual(
                    "row", 1, x, [=](const VectorXd& v) { return VectorXd::Constant(1, value(v)); },
                    [=](const VectorXd& v) -> MatrixXd { return gradient(v).transpose(); }),
                role);
  }
  BlockRef x;
};

TEST(NativeStepTest, WhatIsTiltedByLessThanARightAngleComesUprightByTheShorterTurn) {
  // Towards a right angle the row tells less and less how far to turn, and a whole step would be many turns.
  for (int tilt = 5; tilt < 90; tilt += 1) {
    for (const double weight : {0.0, 1e-3, 1e-2}) {
      Example example;
      const BlockRef box = example.program.AddPose("box");
      example.guess.poses.push_back(Pose(math::ExpSO3({tilt * std::numbers::pi / 180, 0, 0}), {0, 0, 0}));
      example.program.Add(PoseToTarget(box, example.guess.poses[0], 1, weight), Role::kCost);
      example.program.Add(Upright(box), Role::kEquality);
      const Result result = SolveNatively(example);
      ASSERT_TRUE(result.ok()) << tilt << " degrees, weight " << weight << ": " << result.Summary();
      EXPECT_NEAR(result.x.poses[0].R(2, 2), 1, 1e-6) << tilt << " degrees, weight " << weight;
      EXPECT_LE(result.iterations, 6) << tilt << " degrees, weight " << weight;
    }
  }
}

TEST(NativeStepTest, TheSubproblemIsSolvedHoweverFarARowIsFromFeasible) {
  // A steep row far away needs a multiplier that is small in its interval: where Mehrotra's corrector cycles,
  // and the guess used to be reported as locally infeasible.
  for (const double nu : {1.0, 10.0, 1e3, 1e5}) {
    for (const double far : {0.3, 1.0, 7.5, 100.0}) {
      Random random(1);
      Nearest example(2, random, 1);
      example.AddRow(
          Role::kEquality, [=](const VectorXd& v) { return 5 * v[0] + 3 * v[1] + far; },
          [](const VectorXd&) -> VectorXd { return Eigen::Vector2d(5, 3); });
      ManifoldView view(example.program);
      ManifoldView::Values values = view.MakeValues();
      ASSERT_TRUE(view.Evaluate(view.Start(example.guess), values));
      ElasticQp qp(view);
      EXPECT_TRUE(qp.Solve(values, values.rows, nu, 1e-3, 1e-10 * nu)) << nu << " " << far;
      VectorXd Jd(1), Hd(6);
      qp.Multiply(values, qp.d(), Jd);
      qp.MultiplyCurvature(values, qp.d(), Hd);
      const double row = values.rows[0] + Jd[0], y = qp.y()[0];
      EXPECT_LE(std::abs(y), nu * (1 + 1e-9));
      // Satisfied, or with its multiplier at its bound.
      EXPECT_LT(std::abs(row) * (nu - std::abs(y)), 1e-6 * nu) << nu << " " << far;
      EXPECT_NEAR(values.gradient[0] + Hd[0] + 1e-3 * qp.d()[0] + 5 * y, 0, 1e-6 * nu);
    }
  }
}

TEST(NativeStepTest, CurvedRowsDoNotSlowItDown) {
  // Where a row curves, a step that is right to first order leaves it, and the merit function refuses it: on
  // a circle, and along rods of fixed length. Corrected to second order, fewer steps are refused and
  // shortened; without the corrections it needs about 11,000 and 8,400 iterations.
  int circles = 0, rods = 0;
  for (uint64_t seed = 1; seed <= 400; ++seed) {
    Random random(seed);
    Nearest example(2, random, 1);
    example.AddRow(
        Role::kEquality, [](const VectorXd& v) { return v.norm() - 1; },
        [](const VectorXd& v) -> VectorXd { return v.normalized(); });
    const Result result = SolveNatively(example);
    ASSERT_TRUE(result.ok()) << seed << ": " << result.Summary();
    circles += result.iterations;
  }
  for (uint64_t seed = 1; seed <= 100; ++seed) {
    Random random(seed);
    Example example;
    BlockRef last;
    for (int i = 0; i < 5; ++i) {
      const BlockRef next = example.program.AddPose("link");
      example.guess.poses.push_back(RandomPose(random));
      example.program.Add(PoseToTarget(next, RandomPose(random), 1, 0.3), Role::kCost);
      if (i > 0) example.program.Add(Offset(last, next, Vector3d(0.5, 0, 0)), Role::kEquality);
      last = next;
    }
    const Result result = SolveNatively(example);
    ASSERT_TRUE(result.ok()) << seed << ": " << result.Summary();
    rods += result.iterations;
  }
  EXPECT_LT(circles, 10000);
  EXPECT_LT(rods, 6500);
}

/// Among balls, and behind a wall with an edge that curves away: many steps are refused and leave cuts.
Nearest AmongBalls(uint64_t seed) {
  Random random(seed);
  Nearest example(2, random, 3);
  for (int ball = 0; ball < 3; ++ball) {
    const VectorXd centre = Nearest::Draw(2, random);
    const double radius = random.Uniform(0.2, 1);
    example.AddRow(
        Role::kInequality, [=](const VectorXd& v) { return radius - (v - centre).norm(); },
        [=](const VectorXd& v) -> VectorXd { return -(v - centre).normalized(); });
  }
  const VectorXd a = Nearest::Draw(2, random), b = Nearest::Draw(2, random);
  const double side = random.Normal(), curve = random.Uniform(0, 1);
  example.AddRow(
      Role::kInequality,
      [=](const VectorXd& v) { return std::max(a.dot(v), b.dot(v)) - side - curve * v.squaredNorm(); },
      [=](const VectorXd& v) -> VectorXd { return (a.dot(v) > b.dot(v) ? a : b) - 2 * curve * v; });
  return example;
}

TEST(NativeStepTest, WhereItEndsASecondSolveFindsNothingBetter) {
  int solved = 0, improved = 0;
  for (uint64_t seed = 1; seed <= 1000; ++seed) {
    Nearest example = AmongBalls(seed);
    const Result first = SolveNatively(example);
    if (!first.ok()) continue;
    ++solved;
    example.guess = first.x;
    const Result again = SolveNatively(example);
    if (again.ok() && again.cost < 0.999 * first.cost - 1e-5) ++improved;
  }
  EXPECT_GT(solved, 900);
  // With cuts of earlier points it ends too early 20 times.
  EXPECT_LE(improved, 3);
}

TEST(ElasticQpTest, CutsMoveAlongAndLastForOneStep) {
  Nearest example = AmongBalls(3);
  ManifoldView view(example.program);
  ManifoldView::Values here = view.MakeValues(), there = view.MakeValues();
  const Point x = view.Start(example.guess);
  ASSERT_TRUE(view.Evaluate(x, here));
  Point moved = x;
  VectorXd step = VectorXd::Zero(6), next = VectorXd::Zero(6);
  step.head<2>() << 0.3, -0.2;
  next.head<2>() << -0.1, 0.4;
  view.Move(x, step, 1, moved);
  ASSERT_TRUE(view.Evaluate(moved, there));
  // Every inequality is above its prediction.
  there.rows.setConstant(0.5);
  ElasticQp qp(view);
  const VectorXd low = VectorXd::Constant(here.rows.size(), -1e9);
  ASSERT_EQ(qp.AddCuts(there, step, low), view.num_rows());
  const auto foreseen = [&](const VectorXd& d) {
    VectorXd rows = low;
    qp.RaiseToCuts(d, rows);
    return rows;
  };
  EXPECT_LT((foreseen(step) - there.rows).cwiseAbs().maxCoeff(), 1e-12) << "what was seen there";
  EXPECT_TRUE(qp.HasFreshCut(0));
  EXPECT_FALSE(qp.DropOldCuts());
  const VectorXd before = foreseen(step + next);
  qp.MoveCuts(step);
  EXPECT_LT((foreseen(next) - before).cwiseAbs().maxCoeff(), 1e-12) << "the same place, from the new point";
  EXPECT_FALSE(qp.HasFreshCut(0));
  qp.MoveCuts(next);
  EXPECT_EQ(foreseen(next), low) << "forgotten after the second step";
  ASSERT_GT(qp.AddCuts(there, step, low), 0);
  qp.MoveCuts(step);
  EXPECT_TRUE(qp.DropOldCuts());
  EXPECT_EQ(foreseen(next), low);
}

}  // namespace
}  // namespace tether::nlp
