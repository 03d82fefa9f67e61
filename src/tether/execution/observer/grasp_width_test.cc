#include "tether/execution/observer/grasp_width.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tether::execution {
namespace {

using Eigen::Vector3d;
using math::Pose;
using ::testing::HasSubstr;

robot::Gripper Fingers() {
  robot::Gripper gripper;
  gripper.max_opening = 0.08;
  gripper.pad_half_width = 0.01;
  gripper.pad_half_height = 0.012;
  return gripper;
}

TEST(GraspWidth, IsTheExtentBetweenThePads) {
  const geometry::Shape box = geometry::Primitive(geometry::Box{{0.06, 0.05, 0.04}});
  EXPECT_NEAR(*WidthBetweenFingers(box, Pose(), Fingers()), 0.05, 1e-9);
  EXPECT_NEAR(*WidthBetweenFingers(box, Pose(Vector3d(0.035, 0.01, 0)), Fingers()), 0.05, 1e-9);
  EXPECT_FALSE(WidthBetweenFingers(box, Pose(Vector3d(0.05, 0, 0)), Fingers()));
  const geometry::Shape rod = geometry::Primitive(geometry::Capsule{0.01, 0.2});
  const Pose lying(math::RotationFromRpy({0, M_PI / 2, 0}), Vector3d(0.02, 0.003, 0.004));
  EXPECT_NEAR(*WidthBetweenFingers(rod, lying, Fingers()), 0.02, 2e-4);
  // Another part of the body, beyond the fingers, does not count.
  const geometry::Shape two({{geometry::Box{{0.06, 0.03, 0.04}}, Pose()},
                             {geometry::Box{{0.06, 0.02, 0.04}}, Pose(Vector3d(0, 0.06, 0))}});
  EXPECT_NEAR(*WidthBetweenFingers(two, Pose(), Fingers()), 0.03, 1e-9);
}

// Any width above 2 mm counted as the object that was to be grasped.
TEST(GraspWidth, TheWidthHeldMustBeTheObjects) {
  const geometry::Shape box = geometry::Primitive(geometry::Box{{0.05, 0.05, 0.05}});
  EXPECT_EQ(WrongWidth(0.0498, box, Pose(), Fingers(), 0.002), "");
  EXPECT_EQ(WrongWidth(0.053, box, Pose(), Fingers(), 0.002), "");
  EXPECT_EQ(WrongWidth(0.001, box, Pose(), Fingers(), 0.002), "nothing");
  EXPECT_EQ(WrongWidth(0.02, box, Pose(), Fingers(), 0.002), "something 20.0 mm wide (not 50.0 mm)");
  EXPECT_EQ(WrongWidth(0.06, box, Pose(), Fingers(), 0.002), "something 60.0 mm wide (not 50.0 mm)");
  EXPECT_EQ(WrongWidth(0.03, box, Pose(Vector3d(0.1, 0, 0)), Fingers(), 0.002),
            "something else, 30.0 mm wide");
  robot::Gripper hinged = Fingers();
  hinged.open = {0, 0, 0};
  EXPECT_EQ(WrongWidth(0.044, box, Pose(), hinged, 0.002), "");
  EXPECT_NE(WrongWidth(0.02, box, Pose(), hinged, 0.002), "");
}

}  // namespace
}  // namespace tether::execution
