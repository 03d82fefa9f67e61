#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/execution/fake_arm.h"

namespace tether::execution {
namespace {

using ::testing::HasSubstr;

// Whatever it does, it stands still until it is told to go on, and then goes on where it was.
TEST(PauseTest, TheArmStandsStillAndGoesOn) {
  FakeArm fake;
  fake.Start({"move(left)", "grasp(block,left)"});
  fake.Run(1);
  fake.executive->Pause(true);
  fake.Run(0.5);
  const Eigen::VectorXd q = fake.observations["jaco"].q;
  const int step = fake.executive->step();
  fake.Run(2);
  EXPECT_LT((fake.observations["jaco"].q - q).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_EQ(fake.executive->step(), step);
  fake.executive->Pause(false);
  fake.Run(80);
  EXPECT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
  EXPECT_THAT(fake.Story(), ::testing::AllOf(HasSubstr("paused"), HasSubstr("continued")));
}

}  // namespace
}  // namespace tether::execution
