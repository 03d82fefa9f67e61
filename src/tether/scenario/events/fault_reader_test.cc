#include "tether/scenario/events/fault_reader.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/common/document/value.h"
#include "tether/common/error.h"

namespace tether::scenario {
namespace {

using Kind = robot::Fault::Kind;
using ::testing::HasSubstr;

scene::Scene OneArm() {
  scene::Scene scene;
  scene::Robot& arm = scene.robots.emplace_back();
  arm.name = arm.model = "panda";
  arm.q.assign(7, 0.0);
  scene::Object cup;
  cup.name = "cup";
  cup.shape = geometry::Primitive(geometry::Box{{0.05, 0.05, 0.05}});
  scene.objects.push_back(cup);
  return scene;
}

std::vector<Event> Parse(const std::string& fault, Diagnostics& diagnostics) {
  const scene::Scene scene = OneArm();
  return ParseEvents(ParseYaml("- when: {time: 1}\n  fault: " + fault + "\n", "s.yaml"), {&scene, nullptr},
                     diagnostics);
}

std::string ErrorOf(const std::string& fault) {
  Diagnostics diagnostics;
  Parse(fault, diagnostics);
  try {
    diagnostics.ThrowIfAny();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

robot::Fault FaultOf(const std::string& fault, std::string* description) {
  Diagnostics diagnostics;
  const std::vector<Event> events = Parse(fault, diagnostics);
  diagnostics.ThrowIfAny();
  *description = events.at(0).Describe();
  return std::get<robot::Fault>(events.at(0).other);
}

TEST(FaultReader, ReadsEveryKind) {
  std::string text;
  EXPECT_EQ(FaultOf("{kind: silence, robot: panda, over: 0.1}", &text).over, 0.1);
  EXPECT_EQ(text, "fault of panda: silence for 0.1 s");
  EXPECT_TRUE(std::isinf(FaultOf("{kind: silence, poses: true}", &text).over));
  EXPECT_EQ(text, "fault of the poses of objects: silence");
  EXPECT_EQ(FaultOf("{kind: not_finite, object: cup, over: 1}", &text).object, "cup");
  EXPECT_EQ(text, "fault of the pose of cup: not_finite for 1 s");
  EXPECT_EQ(FaultOf("{kind: clock, robot: panda, by: -5}", &text).by, -5);
  EXPECT_EQ(text, "fault of panda: clock off by -5 s");
  EXPECT_EQ(FaultOf("{kind: encoder, robot: panda, joint: 4, by: 0.3, over: 0.005}", &text).joint, 3);
  EXPECT_EQ(text, "fault of panda: encoder of joint 4 off by 0.3 rad for 0.005 s");
  EXPECT_EQ(FaultOf("{kind: gripper, robot: panda, over: 1}", &text).kind, Kind::kGripper);
}

TEST(FaultReader, SaysWhatIsAccepted) {
  EXPECT_THAT(ErrorOf("{robot: panda}"), HasSubstr("silence, not_finite, clock, encoder or gripper"));
  EXPECT_THAT(ErrorOf("{kind: silense, robot: panda}"), HasSubstr("did you mean 'silence'?"));
  EXPECT_THAT(ErrorOf("{kind: silence}"), HasSubstr("one of 'robot', 'object' and 'poses: true'"));
  EXPECT_THAT(ErrorOf("{kind: gripper, object: cup}"), HasSubstr("needs to say of what"));
  EXPECT_THAT(ErrorOf("{kind: silence, robot: panda, object: cup}"), HasSubstr("needs to say of what"));
  EXPECT_THAT(ErrorOf("{kind: silence, robot: pandra}"), HasSubstr("unknown robot 'pandra' in event"));
  EXPECT_THAT(ErrorOf("{kind: silence, object: cap}"), HasSubstr("unknown object 'cap' in event"));
  EXPECT_THAT(ErrorOf("{kind: clock, robot: panda}"), HasSubstr("'by'"));
  EXPECT_THAT(ErrorOf("{kind: clock, robot: panda, by: 0}"), HasSubstr("'by' of event is 0"));
  EXPECT_THAT(ErrorOf("{kind: encoder, robot: panda, by: 0.1, joint: 8}"),
              HasSubstr("'joint' of event is 8 (a whole number from 1 to 7)"));
  EXPECT_THAT(ErrorOf("{kind: silence, robot: panda, over: 0}"), HasSubstr("'over' of event"));
  EXPECT_THAT(ErrorOf("{kind: silence, robot: panda, joint: 1}"), HasSubstr("joint"));
  EXPECT_THAT(ErrorOf("{kind: silence, robot: panda}\n  push: {robot: panda, torques: [1], over: 1}"),
              HasSubstr("event has both 'push' and 'fault'"));
}

}  // namespace
}  // namespace tether::scenario
