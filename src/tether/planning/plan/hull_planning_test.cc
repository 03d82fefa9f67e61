// Convex polytopes, as hulls and meshes give them, are picked, placed and pushed wherever they stand.

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/planning/test_scene.h"
#include "tether/common/random.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/planning/check/checker.h"
#include "tether/planning/plan/candidate.h"
#include "tether/planning/program/program_builder.h"

namespace tether::planning {
namespace {

using Eigen::Vector3d;
using math::Pose;
using std::numbers::pi;
using ::testing::HasSubstr;

/// An upright prism with an even number of sides, 3 to 6.5 cm across, some narrower in one direction or a
/// little tapered, in an arbitrary frame, standing on the table's top.
scene::Object RandomPart(Random& random, double x, double y, double most_taper) {
  const int sides = 2 * (2 + random.Index(5));
  const double across = random.Uniform(0.03, 0.065), height = random.Uniform(0.03, 0.06);
  const double squash = sides == 4 ? random.Uniform(0.6, 1) : 1, taper = random.Uniform(0, most_taper);
  const Pose X_FP(math::ExpSO3(Vector3d(random.Normal(), random.Normal(), random.Normal())),
                  0.05 * Vector3d(random.Normal(), random.Normal(), random.Normal()));
  std::vector<Vector3d> points;
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * pi * (i + 0.5) / sides, radius = 0.5 * across / std::cos(pi / sides);
    for (const bool top : {false, true}) {
      const double r = top ? radius - taper : radius;
      points.push_back(X_FP * Vector3d(r * std::cos(angle), squash * r * std::sin(angle), top ? height : 0));
    }
  }
  scene::Object part;
  part.name = "part";
  part.shape = geometry::Shape({geometry::CentredPart(*geometry::MakeHull(points).hull, Pose())});
  part.parent = "table";
  part.X_ParentObject =
      Pose(math::ExpSO3({0, 0, random.Uniform(-pi, pi)}), {x - 0.5, y, 0.25}) * X_FP.Inverse();
  part.mass = 0.1;
  return part;
}

/// Workspace Reach with another thing in place of its box.
Problem ProblemWith(const scene::Object& part) {
  scene::Scene scene = ReachScene();
  scene.objects[2] = part;
  return PandaProblem(scene);
}

void ExpectFeasible(const Problem& problem, const std::vector<std::string>& actions,
                    const std::string& what) {
  const SceneFacts facts(problem);
  const Limits limits(problem.search);
  const Verdict verdict = OptimizeCandidate(facts, actions, 0, limits);
  EXPECT_TRUE(verdict.report.feasible()) << what << ": " << verdict.report.reason;
  if (!verdict.report.feasible()) return;
  EXPECT_TRUE(CheckPlan(problem, verdict.report.plan).Feasible(problem.program)) << what;
}

TEST(HullPlanningTest, RandomPrismsArePickedAndPlaced) {
  Random random(21);
  for (int trial = 0; trial < 25; ++trial) {
    const scene::Object part =
        RandomPart(random, random.Uniform(0.4, 0.65), random.Uniform(-0.1, 0.25), 0.002);
    ExpectFeasible(ProblemWith(part), {"pick(part)", "place(part,shelf)"}, "trial " + std::to_string(trial));
  }
}

TEST(HullPlanningTest, RandomPrismsOutOfReachArePulledNear) {
  Random random(22);
  for (int trial = 0; trial < 12; ++trial) {
    const scene::Object part = RandomPart(random, random.Uniform(0.85, 0.95), random.Uniform(-0.1, 0.1), 0);
    ExpectFeasible(
        ProblemWith(part),
        {"pick(hook)", "push(hook,part,table)", "place(hook,table)", "pick(part)", "place(part,shelf)"},
        "trial " + std::to_string(trial));
  }
}

/// The same solid as a box and as the hull of its corners: the same optimum.
TEST(HullPlanningTest, ABoxOfCornersCostsWhatABoxCosts) {
  Problem problem = ReachProblem();
  const std::vector<std::string> actions{"pick(hook)", "push(hook,box,table)", "place(hook,table)",
                                         "pick(box)", "place(box,shelf)"};
  const auto cost = [&] {
    const SceneFacts facts(problem);
    const Verdict verdict = OptimizeCandidate(facts, actions, 0, Limits(problem.search));
    EXPECT_TRUE(verdict.report.feasible()) << verdict.report.reason;
    return verdict.report.plan.cost;
  };
  const double as_box = cost();
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i)
    corners.push_back(0.025 * Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  problem.scene.objects[2].shape = geometry::Shape(geometry::Primitive(*geometry::MakeHull(corners).hull));
  EXPECT_NEAR(cost(), as_box, 5e-3 * as_box);
}

TEST(HullPlanningTest, WhatHasNoOppositeSidesIsNotModelled) {
  Problem problem = ReachProblem();
  const std::vector<Vector3d> corners{{0.02, 0, -0.025}, {-0.01, 0.017, -0.025}, {-0.01, -0.017, -0.025},
                                      {0.02, 0, 0.025},  {-0.01, 0.017, 0.025},  {-0.01, -0.017, 0.025}};
  problem.scene.objects[2].shape = geometry::Shape(geometry::Primitive(*geometry::MakeHull(corners).hull));
  const SceneFacts facts(problem);
  const KeyPoseProgram key_poses = BuildProgram(facts, BindSkeleton(problem, {"pick(box)"}));
  ASSERT_EQ(key_poses.refutations.size(), 1u);
  EXPECT_THAT(
      key_poses.refutations[0],
      HasSubstr("pick(box): not modelled: no two sides of box face each other across the fingers' approach"));
}

/// Rows of hulls keep what every row must: their Jacobians are exact.
TEST(HullPlanningTest, EveryJacobianAgreesWithNumericDifferentiation) {
  Random random(23);
  const Problem problem = ProblemWith(RandomPart(random, 0.9, 0, 0));
  const SceneFacts facts(problem);
  const auto steps = BindSkeleton(problem, {"pick(hook)", "push(hook,part,table)", "place(hook,table)",
                                            "pick(part)", "place(part,shelf)"});
  const KeyPoseProgram key_poses = BuildProgram(facts, steps);
  ASSERT_THAT(key_poses.refutations, ::testing::IsEmpty());
  nlp::Point x = key_poses.guess;
  for (math::Pose& pose : x.poses) {
    math::Vector6d delta;
    for (int i = 0; i < 6; ++i) delta[i] = 0.05 * random.Normal();
    pose = pose * math::ExpSE3(delta);
  }
  int on_sides = 0;
  for (const nlp::Term& term : key_poses.program.terms()) {
    const nlp::Residual& residual = *term.residual;
    const double error = nlp::JacobianError(residual, key_poses.program, x, 1e-6);
    // Ties of the distance have one-sided derivatives.
    if (residual.name().find("clearance") != std::string::npos && error > 1e-4) continue;
    EXPECT_LT(error, 1e-6) << residual.name();
    if (residual.name().find("fingers on its sides") != std::string::npos) ++on_sides;
  }
  EXPECT_EQ(on_sides, 1);
}

}  // namespace
}  // namespace tether::planning
