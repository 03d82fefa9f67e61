#include <algorithm>
#include <numbers>

#include <gtest/gtest.h>

#include "testing/planning/test_scene.h"
#include "tether/constraints/grasps/grasp.h"
#include "tether/planning/program/step_context.h"

namespace tether::planning {
namespace {

using constraints::Grasp;
using Eigen::Vector3d;
using math::Pose;

/// Grasps of an object of the workspace as its first step sees it, with the whole world at X.
std::vector<Grasp> GraspsOf(const std::string& object, const Pose& X) {
  Problem problem = ReachProblem();
  for (scene::Object& one : problem.scene.objects) {
    if (one.parent == scene::kWorld) one.X_ParentObject = X * one.X_ParentObject;
  }
  for (scene::Robot& one : problem.scene.robots) one.X_ParentBase = X * one.X_ParentBase;
  problem.robot.X_WBase = X * problem.robot.X_WBase;
  problem.robot.X_WHand = X * problem.robot.X_WHand;
  const SceneFacts facts(problem);
  const std::vector<BoundStep> steps = BindSkeleton(problem, {"pick(" + object + ")"});
  FrameTree tree(facts.frames(), problem.scene, problem.robot.X_WHand);
  EXPECT_TRUE(tree.AddStep(steps[0].control, steps[0].target));
  const constraints::KnownOfProgram known;
  const std::vector<Pose> poses(1);
  const StepContext context(facts, known, tree, poses, 0, steps[0],
                            [](const constraints::ChoiceKey&, const auto&) { return 0; });
  return FindGrasps(context, facts.frames().Find(object));
}

class GraspLaws : public ::testing::TestWithParam<const char*> {};

TEST_P(GraspLaws, FingersCloseAcrossTheApproachOnWhatFitsBetweenThem) {
  const std::vector<Grasp> grasps = GraspsOf(GetParam(), {});
  const double opening = robot::Model::Load("panda")->gripper().max_opening;
  ASSERT_FALSE(grasps.empty());
  for (const Grasp& grasp : grasps) {
    EXPECT_NEAR(grasp.approach_O.norm(), 1, 1e-12) << grasp.label;
    EXPECT_GT(grasp.width, 0) << grasp.label;
    EXPECT_LE(grasp.width, opening) << grasp.label;
    if (!grasp.closing_O) continue;
    EXPECT_NEAR(grasp.closing_O->norm(), 1, 1e-12) << grasp.label;
    EXPECT_NEAR(grasp.closing_O->dot(grasp.approach_O), 0, 1e-9) << grasp.label;
  }
  EXPECT_TRUE(std::is_sorted(grasps.begin(), grasps.end(),
                             [](const Grasp& a, const Grasp& b) { return a.score < b.score - 1e-9; }));
}

// Where the world stands, and how it is turned about the vertical, is nothing to the hand: grasps are
// relative to the object, and so is their order.
TEST_P(GraspLaws, MovingTheWorldChangesNothing) {
  const std::vector<Grasp> here = GraspsOf(GetParam(), {});
  for (const double yaw : {0.5 * std::numbers::pi, 0.8, -2.5}) {
    const Pose X(math::ExpSO3(Vector3d(0, 0, yaw)), Vector3d(0.7, -1.3, 0.4));
    const std::vector<Grasp> there = GraspsOf(GetParam(), X);
    ASSERT_EQ(there.size(), here.size());
    for (size_t i = 0; i < here.size(); ++i) {
      EXPECT_EQ(there[i].label, here[i].label);
      EXPECT_EQ(there[i].part, here[i].part);
      EXPECT_NEAR(there[i].score, here[i].score, 1e-9);
      EXPECT_LT((there[i].centre_O - here[i].centre_O).norm(), 1e-12);
      EXPECT_LT((there[i].approach_O - here[i].approach_O).norm(), 1e-12);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Objects, GraspLaws, ::testing::Values("box", "hook"),
                         [](const auto& test) { return std::string(test.param); });

}  // namespace
}  // namespace tether::planning
