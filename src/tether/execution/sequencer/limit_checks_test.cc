#include "tether/execution/sequencer/limit_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/execution/test_plans.h"

namespace tether::execution {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class LimitChecksTest : public ::testing::Test {
 protected:
  LimitChecksTest() {
    const geometry::Shape cube = geometry::Primitive(geometry::Box{{0.05, 0.05, 0.05}});
    scene_ = TableScene();
    scene_.objects.push_back(MakeObject("box", cube, math::Pose(Eigen::Vector3d(0.5, 0.15, 0.025))));
    scene_.objects.push_back(MakeObject("other", cube, math::Pose(Eigen::Vector3d(0.5, -0.15, 0.025))));
    for (scene::Object& object : scene_.objects) object.friction = 0.5;
    scene_.objects.back().mass = 2;
    plan_ = PlanBuilder()
                .Pick("box", TopGrasp({0, 0, 0}))
                .Push("box", "other", "table", math::Pose(Eigen::Vector3d(0.06, 0, 0)),
                      math::Pose(Eigen::Vector3d(0, 0, 0.275)))
                .Build();
  }
  std::string ErrorOf(double max_force) const {
    try {
      RequireForces(scene_, plan_, max_force, {"file.yaml", 7, 3}, 2.5);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  scene::Scene scene_;
  planning::Plan plan_;
};

TEST_F(LimitChecksTest, AForceThatCannotSlideWhatIsPushedIsRefused) {
  // 2 kg · 9.81 m/s² · 0.5, and a fifth more.
  EXPECT_EQ(ErrorOf(12), "");
  EXPECT_THAT(ErrorOf(11),
              AllOf(HasSubstr("file.yaml:7:3"), HasSubstr("'max_force' of 'execution' is 11.0 N"),
                    HasSubstr("to slide 'other' takes 11.8 N"), HasSubstr("at least 11.8 N")));
  // The slipperier surface counts.
  for (scene::Object& object : scene_.objects) {
    if (object.name == "table") object.friction = 0.1;
  }
  EXPECT_EQ(ErrorOf(3), "");
}

TEST_F(LimitChecksTest, AStepMayHaveItsOwnForce) {
  for (planning::PlanStep& step : plan_.steps) {
    if (step.mode == planning::StepMode::kPush) step.max_force = 5;
  }
  EXPECT_THAT(ErrorOf(100), HasSubstr("'max_force' of the step is 5.0 N"));
}

TEST_F(LimitChecksTest, TheShippedRobotHoldsItsStartPose) {
  EXPECT_NO_THROW(RequireHoldable(scene_, "panda", *robot::Model::Load("panda")));
}

}  // namespace
}  // namespace tether::execution
