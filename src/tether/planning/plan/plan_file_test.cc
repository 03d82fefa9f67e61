#include "tether/planning/plan/plan_file.h"

#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/planning/skeleton/action_reader.h"

namespace tether::planning {
namespace {

using ::testing::HasSubstr;

scene::Scene MakeScene() {
  scene::Scene scene;
  scene.robots.push_back({"arm", "panda", {}, scene::kWorld, {}});
  scene.objects.push_back(
      {"table", geometry::Shape(geometry::Box{{1, 1, 0.1}}), std::nullopt, 0.8, scene::kWorld, {}, {}});
  scene.objects.push_back({"hook",
                           geometry::Shape(std::vector<geometry::Part>{{geometry::Capsule{0.01, 0.2}, {}},
                                                                       {geometry::Sphere{0.02}, {}}}),
                           0.1,
                           0.8,
                           "table",
                           math::Pose(Eigen::Vector3d(0.1, 0, 0.06)),
                           {}});
  scene.regions.push_back({"zone", scene::Disc{0.1}, scene::kWorld, {}, 0, 0, false});
  return scene;
}

std::vector<ActionSchema> MakeActions() {
  return ReadActions(std::string(TETHER_SOURCE_DIR) + "/models/actions/manipulation.yaml");
}

Plan MakePlan() {
  Plan plan;
  plan.scenario = "Test";
  plan.robot = "arm";
  plan.actions = {"pick(hook)", "place(hook,table)"};
  plan.cost = 1.0 / 3;
  Random random(5);
  const std::vector<StepSchema> bound = BindAction(MakeActions()[0], {"hook"});
  const Eigen::Vector3d w(random.Normal(), random.Normal(), random.Normal());
  plan.steps.push_back({"pick(hook)", 0, "hand", "hook",
                        math::Pose(math::ExpSO3(w), {random.Normal(), random.Normal(), random.Normal()}),
                        bound[0].execute});
  ReachVerb reach{{0.1, 1.0 / 3, 1e-17},
                  In::kTarget,
                  0.3,
                  0.001,
                  0.1 / 3,
                  true,
                  0.07,
                  "plane_distance",
                  ParseYaml("[tilt: {max: 1}]", "")};
  plan.steps.push_back(
      {"place(hook,table)",
       1,
       "hook",
       "table",
       math::Pose(),
       {reach, WaitVerb{0.1}, GripperVerb{"", 13.5}, ShiftVerb{{1, 2, 3}, In::kHand, 0.07}}});
  plan.steps[0].q = Eigen::Vector3d(0.1, -1.0 / 3, 2e-17);
  plan.steps[0].motion = {{Eigen::Vector3d(0.2, 0, 1.0 / 3), Eigen::Vector3d(0.1, -1, 0)}, 1.5, 0.012};
  SetModes(&plan);
  return plan;
}

std::string ErrorOf(const std::string& text, const scene::Scene& scene,
                    const std::vector<ActionSchema>& actions) {
  Diagnostics diagnostics;
  ParsePlan(ParseYaml(text, "p.json"), scene, actions, diagnostics);
  std::string all;
  for (const Diagnostic& diagnostic : diagnostics.list()) all += diagnostic.ToString() + "\n";
  return all;
}

std::string Written() {
  return WriteJson(WritePlan(MakePlan(), {"0.1", 9, "s.yaml"}, MakeScene(), MakeActions()));
}

TEST(PlanFileTest, RoundTripKeepsEverything) {
  const Plan plan = MakePlan();
  const std::string text = Written();
  EXPECT_EQ(text.rfind("{\n  \"format\": \"tether.plan/1\",\n  \"tether\": \"0.1\",\n  \"seed\": 9,", 0), 0u);
  Diagnostics diagnostics;
  const Value document = ParseYaml(text, "p.json");
  const Plan back = ParsePlan(document, MakeScene(), MakeActions(), diagnostics);
  for (const Diagnostic& diagnostic : diagnostics.list()) ADD_FAILURE() << diagnostic.ToString();
  EXPECT_EQ(ReadPlanOrigin(document).seed, 9u);
  EXPECT_EQ(ReadPlanOrigin(document).scenario_file, "s.yaml");
  EXPECT_EQ(back.scenario, plan.scenario);
  EXPECT_EQ(back.robot, plan.robot);
  EXPECT_EQ(back.actions, plan.actions);
  EXPECT_EQ(back.cost, plan.cost);
  ASSERT_EQ(back.steps.size(), plan.steps.size());
  for (size_t i = 0; i < plan.steps.size(); ++i) {
    const PlanStep &a = plan.steps[i], &b = back.steps[i];
    EXPECT_EQ(b.action, a.action);
    EXPECT_EQ(b.action_index, a.action_index);
    EXPECT_EQ(b.control, a.control);
    EXPECT_EQ(b.target, a.target);
    EXPECT_EQ(b.mode, a.mode);
    EXPECT_EQ(b.held, a.held);
    EXPECT_EQ(b.tool, a.tool);
    EXPECT_EQ(b.X_TC.p, a.X_TC.p);
    EXPECT_TRUE(b.X_TC.R.isApprox(a.X_TC.R, 1e-14));
    ASSERT_EQ(b.motion.has_value(), a.motion.has_value());
    if (a.motion) {
      EXPECT_EQ(b.motion->path, a.motion->path);
      EXPECT_EQ(b.motion->duration, a.motion->duration);
      EXPECT_EQ(b.motion->clearance, a.motion->clearance);
    }
    ASSERT_EQ(b.execute.size(), a.execute.size());
    for (size_t j = 0; j < a.execute.size(); ++j) {
      EXPECT_EQ(WriteJson(WriteVerb(b.execute[j])), WriteJson(WriteVerb(a.execute[j])));
    }
  }
  const auto& reach = std::get<ReachVerb>(back.steps[1].execute[0]);
  EXPECT_EQ(reach.offset, Eigen::Vector3d(0.1, 1.0 / 3, 1e-17));
  EXPECT_EQ(reach.in, In::kTarget);
  EXPECT_EQ(reach.rotation_tolerance, 0.1 / 3);
  EXPECT_TRUE(reach.until_contact);
  EXPECT_EQ(std::get<GripperVerb>(back.steps[1].execute[2]).force, 13.5);
  EXPECT_EQ(std::get<ShiftVerb>(back.steps[1].execute[3]).in, In::kHand);
}

// Files from before steps had a mode are read; what a file says of it is for people, and follows from its
// verbs.
TEST(PlanFileTest, ModesMayBeMissing) {
  const auto without = [](const std::string& key) {
    std::string text, all = Written();
    for (size_t from = 0, to = 0; from < all.size(); from = to + 1) {
      to = std::min(all.find('\n', from), all.size());
      const std::string line = all.substr(from, to - from);
      // The last key of a step: the comma before it goes too.
      if (line.find("\"" + key + "\":") == std::string::npos) {
        text += line + "\n";
      } else if (line.back() != ',') {
        text.erase(text.rfind(','), 1);
      }
    }
    return text;
  };
  EXPECT_NE(without("mode"), Written());
  EXPECT_EQ(ErrorOf(without("mode"), MakeScene(), MakeActions()), "");
  std::string wrong = Written();
  const size_t at = wrong.find("\"mode\": \"");
  const size_t begin = at + 9, end = wrong.find('"', begin);
  wrong.replace(begin, end - begin, "region");
  EXPECT_EQ(ErrorOf(wrong, MakeScene(), MakeActions()), "");
  wrong.replace(begin, 6, "pull");
  EXPECT_NE(ErrorOf(wrong, MakeScene(), MakeActions()).find("'mode' of step is 'pull'"), std::string::npos);
}

TEST(PlanFileTest, APathOfOneConfigurationIsNone) {
  std::string wrong = Written();
  const size_t begin = wrong.find("\"path\": ["), end = wrong.find("]", wrong.find("]", begin) + 1);
  ASSERT_NE(begin, std::string::npos);
  wrong.replace(begin, wrong.find("]", end + 1) + 1 - begin, "\"path\": [[0.1, 0.2, 0.3]]");
  EXPECT_NE(ErrorOf(wrong, MakeScene(), MakeActions())
                .find("'path' of step is not a path (accepted: a list of at least two configurations"),
            std::string::npos)
      << ErrorOf(wrong, MakeScene(), MakeActions());
}

TEST(PlanFileTest, PosesMassesAndFrictionMayDiffer) {
  scene::Scene scene = MakeScene();
  scene.objects[1].X_ParentObject.p.x() += 0.3;
  scene.objects[1].mass = 0.2;
  scene.objects[1].friction = 0.1;
  EXPECT_EQ(ErrorOf(Written(), scene, MakeActions()), "");
}

TEST(PlanFileTest, WhatDiffersIsSaid) {
  scene::Scene scene = MakeScene();
  scene.robots[0].model = "other";
  std::get<geometry::Capsule>(scene.objects[1].shape.parts[0].primitive).length = 0.21;
  scene.objects[0].name = "tables";
  scene.regions[0].form = scene::Disc{0.2};
  std::vector<ActionSchema> actions = MakeActions();
  actions[0].steps[0].constraints.pop_back();
  const std::string errors = ErrorOf(Written(), scene, actions);
  const std::string another = "the plan was made for another scenario: ";
  EXPECT_THAT(errors, HasSubstr(another + "object 'hook' has another shape"));
  EXPECT_THAT(
      errors,
      HasSubstr(another + "there is no object 'table' (did you mean 'tables'? accepted: tables or hook)"));
  EXPECT_THAT(errors, HasSubstr(another + "object 'tables' was not there"));
  EXPECT_THAT(errors, HasSubstr(another + "robot 'arm' has another model"));
  EXPECT_THAT(errors, HasSubstr(another + "region 'zone' has another form"));
  EXPECT_THAT(errors, HasSubstr(another + "action 'pick' has other parameters, steps or constraints"));
  EXPECT_THAT(errors, HasSubstr("p.json:"));
}

TEST(PlanFileTest, MistakesAreReportedAtTheirPlaces) {
  const std::string errors =
      ErrorOf(R"json({"format": "tether.plan/1", "robot": "leg", "actions": ["pick(hook)"],
"steps": [{"action": "pick(hook)", "action_index": 7, "control": "hnd", "target": "hook", "position": [0, 0],
"quaternion_wxyz": [0, 0, 0, 0], "execute": [{"jump": {}}], "tagret": 1}]})json",
              MakeScene(), MakeActions());
  EXPECT_THAT(errors, HasSubstr("there is no robot 'leg'"));
  EXPECT_THAT(errors, HasSubstr("'action_index' of step is 7 (0 to 0)"));
  EXPECT_THAT(errors, HasSubstr("p.json:2:66: unknown frame 'hnd' as control of step (did you mean 'hand'?"));
  EXPECT_THAT(errors, HasSubstr("'position' of step is a list of 2"));
  EXPECT_THAT(errors, HasSubstr("'quaternion_wxyz' of step has length zero"));
  EXPECT_THAT(errors, HasSubstr("unknown verb 'jump'"));
  EXPECT_THAT(errors, HasSubstr("unknown key 'tagret' in step (did you mean 'target'?"));
  EXPECT_THAT(errors, HasSubstr("the plan lacks 'made_for'"));
}

TEST(PlanFileTest, AFileOfAnotherFormatIsOneMistake) {
  EXPECT_EQ(ErrorOf(R"({"format": "tether.scenario/1", "objects": {}})", MakeScene(), MakeActions()),
            "p.json:1:12: format is 'tether.scenario/1' (accepted: tether.plan/1)\n");
}

/// What is said of the plan after `edit`.
std::string ErrorAfter(const std::function<void(Plan&)>& edit) {
  Plan plan = MakePlan();
  edit(plan);
  return ErrorOf(WriteJson(WritePlan(plan, {"0.1", 9, "s.yaml"}, MakeScene(), MakeActions())), MakeScene(),
                 MakeActions());
}

TEST(PlanFileTest, OnlyTheDifferencesOfAnotherScenarioAreSaid) {
  scene::Scene scene = MakeScene();
  scene.objects[1].name = "rake";
  EXPECT_THAT(ErrorOf(Written(), scene, MakeActions()), ::testing::Not(HasSubstr("unknown frame")));
}

TEST(PlanFileTest, KeyPosesAreThoseOfTheActions) {
  EXPECT_EQ(ErrorAfter([](Plan&) {}), "");
  EXPECT_THAT(
      ErrorAfter([](Plan& plan) { std::swap(plan.actions[0], plan.actions[1]); }),
      HasSubstr("key pose 1 is of 'hand' in 'hook', for pick(hook) (action_index 0) (the plan's actions "
                "require 'hook' in 'table', for place(hook,table) (action_index 0))"));
  EXPECT_THAT(ErrorAfter([](Plan& plan) { plan.steps.pop_back(); }),
              HasSubstr("the plan has 1 key poses (its actions require 2)"));
  EXPECT_THAT(
      ErrorAfter([](Plan& plan) { plan.actions[0] = "pik(hook)"; }),
      HasSubstr(
          "unknown action 'pik' in the plan (did you mean 'pick'? accepted: pick, place, push or press)"));
  EXPECT_THAT(ErrorAfter([](Plan& plan) { plan.actions[0] = "pick(hok)"; }),
              HasSubstr("unknown frame 'hok' in the plan's actions (did you mean 'hook'?"));
  EXPECT_THAT(ErrorAfter([](Plan& plan) { plan.actions[0] = "pick(hook,table)"; }),
              HasSubstr("action 'pick(hook,table)' of the plan has 2 arguments (it takes 1)"));
}

}  // namespace
}  // namespace tether::planning
