#include "tether/planning/skeleton/action_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tether::planning {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::string kLibrary = std::string(TETHER_SOURCE_DIR) + "/models/actions/manipulation.yaml";

std::string ErrorOf(const std::string& text, const ActionReadOptions& options = {}) {
  Diagnostics diagnostics;
  ParseActions(ParseYaml(text, "a.yaml"), options, diagnostics);
  std::string all;
  for (const Diagnostic& diagnostic : diagnostics.list()) all += diagnostic.ToString() + "\n";
  return all;
}

TEST(ActionReaderTest, ReadsTheShippedLibrary) {
  const std::vector<ActionSchema> actions = ReadActions(kLibrary);
  ASSERT_EQ(actions.size(), 4u);
  EXPECT_EQ(actions[0].name, "pick");
  EXPECT_THAT(actions[2].parameters, ElementsAre("a", "b", "c"));
  ASSERT_EQ(actions[2].steps.size(), 2u);
  const StepSchema& pick = actions[0].steps[0];
  EXPECT_EQ(pick.control, "hand");
  EXPECT_EQ(pick.constraints[1].kind, "graspable");
  EXPECT_EQ(pick.constraints[1].parameters.Find("approach")->AsText(), "down");
  EXPECT_THAT(pick.allow, ElementsAre(std::make_pair("hand", "a")));
  ASSERT_EQ(pick.execute.size(), 5u);
  EXPECT_EQ(std::get<ReachVerb>(pick.execute[1]).offset.z(), -0.13);
  EXPECT_EQ(std::get<ReachVerb>(pick.execute[2]).rotation_tolerance, 0.03);
  EXPECT_EQ(std::get<GripperVerb>(pick.execute[3]).close_on, "a");
  EXPECT_EQ(std::get<ShiftVerb>(pick.execute[4]).in, In::kWorld);
  EXPECT_TRUE(std::get<ReachVerb>(actions[1].steps[0].execute[1]).until_contact);
}

TEST(ActionReaderTest, RegionTargetsAndObjectivesAreRead) {
  Diagnostics diagnostics;
  const auto actions = ParseActions(ParseYaml(R"(
format: tether.actions/1
hold:
  parameters: [o, r]
  steps:
  - control: o
    target: {region: r}
    execute:
    - reach: {objective: plane_distance, constraints: [point_cone: {region: r}]}
    - wait: 0.5
)",
                                              "a.yaml"),
                                    {}, diagnostics);
  EXPECT_TRUE(diagnostics.empty());
  const std::vector<StepSchema> steps = BindAction(actions[0], {"cup", "sink"});
  EXPECT_TRUE(steps[0].target_is_region);
  EXPECT_EQ(steps[0].target, "sink");
  const auto& reach = std::get<ReachVerb>(steps[0].execute[0]);
  EXPECT_EQ(reach.objective, "plane_distance");
  EXPECT_EQ(reach.constraints.items()[0].Find("point_cone")->Find("region")->AsText(), "sink");
  EXPECT_EQ(std::get<WaitVerb>(steps[0].execute[1]).seconds, 0.5);
}

TEST(ActionReaderTest, BindingReplacesEveryParameterAndKeepsPlaces) {
  const std::vector<ActionSchema> actions = ReadActions(kLibrary);
  const std::vector<StepSchema> steps = BindAction(actions[2], {"stick", "crate", "desk"});
  EXPECT_EQ(steps[0].control, "stick");
  EXPECT_EQ(steps[0].target, "crate");
  EXPECT_EQ(steps[0].constraints[0].parameters.Find("between")->items()[1].AsText(), "crate");
  const ConstraintSpec& push = steps[1].constraints[0];
  EXPECT_EQ(push.parameters.Find("on")->AsText(), "desk");
  EXPECT_EQ(push.parameters.Find("on")->where().line, actions[2].steps[1].constraints[0].where.line);
  EXPECT_GT(push.parameters.members()[0].where.line, 0);
  // A swap must not replace what it has just put in.
  EXPECT_EQ(BindAction(actions[2], {"b", "a", "c"})[0].control, "b");
  EXPECT_EQ(std::get<GripperVerb>(BindAction(actions[0], {"cup"})[0].execute[3]).close_on, "cup");
}

TEST(ActionReaderTest, WrongNumberOfArgumentsIsBadInput) {
  const std::vector<ActionSchema> actions = ReadActions(kLibrary);
  try {
    BindAction(actions[0], {"a", "b"});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("action 'pick' has 1 parameters, but 2 arguments are given"));
  }
}

TEST(ActionReaderTest, EveryMistakeIsReportedAtItsPlace) {
  ActionReadOptions options;
  options.constraint_kinds = {"inside", "touch"};
  options.frames = std::vector<std::string>{"table", "cup"};
  const std::string errors = ErrorOf(R"(format: tether.actions/1
pick:
  parameters: [a, a, hand]
  step: []
  steps:
  - control: hnd
    target: tabel
    constraints:
    - insid: {frame: hand}
    - {inside: {}, touch: {}}
    allow: [[hand], [hand, b]]
    execute:
    - reech: {}
    - reach: {sped: 1, offset: [0, 0, .inf], in: wrld, until: now, tolerance: [0, 1]}
    - gripper: {close_on: cap}
    - gripper: {open: true, close_on: cup}
    - shift: {in: hand}
    - wait: -1
)",
                                     options);
  EXPECT_THAT(errors, HasSubstr("a.yaml:3:19: parameter 'a' of action 'pick' is given twice"));
  EXPECT_THAT(errors, HasSubstr("a.yaml:3:22: parameter 'hand' of action 'pick' has a reserved name"));
  EXPECT_THAT(errors, HasSubstr("a.yaml:4:3: unknown key 'step' in action 'pick' (did you mean 'steps'? "
                                "accepted: parameters or steps)"));
  EXPECT_THAT(errors,
              HasSubstr("a.yaml:6:14: unknown name 'hnd' as control of action 'pick' (did you mean 'hand'?"));
  EXPECT_THAT(
      errors,
      HasSubstr("a.yaml:7:13: unknown name 'tabel' as target of action 'pick' (did you mean 'table'?"));
  EXPECT_THAT(
      errors,
      HasSubstr("a.yaml:9:7: unknown constraint 'insid' in 'constraints' of action 'pick' (did you mean "
                "'inside'?"));
  EXPECT_THAT(errors,
              HasSubstr("a.yaml:10:7: an entry of 'constraints' of action 'pick' is a map with 2 keys"));
  EXPECT_THAT(errors, HasSubstr("a.yaml:11:13: an entry of 'allow' of action 'pick' is not a pair"));
  EXPECT_THAT(errors, HasSubstr("a.yaml:11:28: unknown name 'b' as an allowed contact"));
  EXPECT_THAT(errors,
              HasSubstr("a.yaml:13:7: unknown verb 'reech' (did you mean 'reach'? accepted: reach, shift, "
                        "gripper or wait)"));
  EXPECT_THAT(errors, HasSubstr("a.yaml:14:15: unknown key 'sped' in verb 'reach' (did you mean 'speed'?"));
  EXPECT_THAT(errors, HasSubstr("'offset' of verb 'reach' has the entry '.inf'"));
  EXPECT_THAT(errors, HasSubstr("'in' of verb 'reach' is 'wrld' (did you mean 'world'?"));
  EXPECT_THAT(errors, HasSubstr("'until' of verb 'reach' is 'now' (accepted: contact)"));
  EXPECT_THAT(errors, HasSubstr("'tolerance' of verb 'reach' has an entry that is not above zero"));
  EXPECT_THAT(
      errors,
      HasSubstr("a.yaml:15:27: unknown name 'cap' as close_on of action 'pick' (did you mean 'cup'?"));
  EXPECT_THAT(errors, HasSubstr("a.yaml:16:16: verb 'gripper' must either open or close"));
  EXPECT_THAT(errors, HasSubstr("verb 'shift' lacks 'by'"));
  EXPECT_THAT(errors, HasSubstr("verb 'wait' has a negative time"));
}

TEST(ActionReaderTest, WrongOrMissingFormatIsSaid) {
  EXPECT_THAT(ErrorOf("format: tether.action/1\n"),
              HasSubstr("a.yaml:1:9: format is 'tether.action/1' (accepted: tether.actions/1)"));
  EXPECT_THAT(ErrorOf("pick: 3\n"), HasSubstr("this action library lacks 'format'"));
  EXPECT_THAT(ErrorOf("pick: 3\n"), HasSubstr("action 'pick' is '3' (a map with keys is accepted)"));
  EXPECT_THAT(ErrorOf("[]"), HasSubstr("an action library is a list"));
}

}  // namespace
}  // namespace tether::planning
