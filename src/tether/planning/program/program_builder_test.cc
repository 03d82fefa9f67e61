#include "tether/planning/program/program_builder.h"

#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/planning/test_scene.h"
#include "tether/planning/check/checker.h"
#include "tether/planning/modes/mode_assignment.h"
#include "tether/planning/skeleton/action_reader.h"

namespace tether::planning {

namespace {

using ::testing::HasSubstr;

const std::vector<std::string> kToTable{"pick(hook)", "push(hook,box,table)", "place(hook,table)",
                                        "pick(box)", "place(box,shelf)"};

TEST(ProgramBuilderTest, EveryJacobianAgreesWithNumericDifferentiation) {
  const Problem problem = ReachProblem();
  const SceneFacts facts(problem);
  const auto steps = BindSkeleton(problem, kToTable);
  ASSERT_EQ(steps.size(), 6u);
  std::set<std::string> kinds;
  int checked = 0;
  for (double noise : {0.05, 0.5, 1.0}) {
    const KeyPoseProgram key_poses = BuildProgram(facts, steps, {}, {noise, false, Random(5)});
    ASSERT_THAT(key_poses.refutations, ::testing::IsEmpty());
    nlp::Point x = key_poses.guess;
    Random random(7);
    for (math::Pose& pose : x.poses) {
      math::Vector6d delta;
      for (int i = 0; i < 6; ++i) delta[i] = 0.05 * random.Normal();
      pose = pose * math::ExpSE3(delta);
    }
    for (const nlp::Term& term : key_poses.program.terms()) {
      const nlp::Residual& residual = *term.residual;
      // Ties of the distance have one-sided derivatives: rows near one are skipped, counted below.
      const double error = nlp::JacobianError(residual, key_poses.program, x, 1e-6);
      const bool distance = residual.name().find("clearance") != std::string::npos;
      if (distance && error > 1e-4) continue;
      EXPECT_LT(error, 1e-6) << residual.name();
      const size_t begin = residual.name().find(": ") + 2;
      kinds.insert(residual.name().substr(begin, residual.name().find_first_of("( ", begin) - begin));
      ++checked;
    }
  }
  EXPECT_GT(checked, 250);
  for (const std::string& kind : constraints::KindNames()) EXPECT_TRUE(kinds.contains(kind)) << kind;
  for (const char* own : {"clearance", "reach", "travel", "turn"}) EXPECT_TRUE(kinds.contains(own)) << own;
}

TEST(ProgramBuilderTest, APlacedObjectDependsOnNoEarlierStep) {
  const Problem problem = ReachProblem();
  const SceneFacts facts(problem);
  const KeyPoseProgram key_poses = BuildProgram(facts, BindSkeleton(problem, kToTable));
  int rows = 0;
  for (const nlp::Term& term : key_poses.program.terms()) {
    if (term.residual->name().find("supported(") == std::string::npos) continue;
    EXPECT_EQ(term.residual->blocks().size(), 1u) << term.residual->name();
    ++rows;
  }
  EXPECT_EQ(rows, 2);
}

TEST(ProgramBuilderTest, WhatIsTooWideIsRefutedInWords) {
  Problem problem = ReachProblem();
  problem.scene.objects[2].shape = geometry::Shape(geometry::Box{{0.1, 0.1, 0.05}});
  const SceneFacts facts(problem);
  const KeyPoseProgram key_poses = BuildProgram(facts, BindSkeleton(problem, {"pick(box)"}));
  ASSERT_EQ(key_poses.refutations.size(), 1u);
  EXPECT_THAT(
      key_poses.refutations[0],
      HasSubstr("pick(box): box is 10.0 cm wide where it is narrowest; the gripper grasps up to 7.5 cm"));
}

TEST(ProgramBuilderTest, NothingCanBePlacedOnWhatItCarries) {
  const Problem problem = ReachProblem();
  const SceneFacts facts(problem);
  const KeyPoseProgram key_poses =
      BuildProgram(facts, BindSkeleton(problem, {"place(box,hook)", "place(hook,box)"}));
  ASSERT_FALSE(key_poses.refutations.empty());
  EXPECT_THAT(key_poses.refutations.back(), HasSubstr("box is attached to hook"));
}

TEST(SkeletonBindingTest, MistakesAreNamed) {
  Problem problem = ReachProblem();
  EXPECT_THAT([&] { BindSkeleton(problem, {"throw(box)"}); },
              ::testing::ThrowsMessage<InputError>(HasSubstr("action 'throw' has no geometry")));
  EXPECT_THAT([&] { BindSkeleton(problem, {"pick(bix)"}); },
              ::testing::ThrowsMessage<InputError>(HasSubstr("did you mean 'box'?")));
}

TEST(FindModeAssignmentsTest, FindsEachOnceTheCheapestFirst) {
  const Problem problem = ReachProblem();
  const SceneFacts facts(problem);
  const auto steps =
      BindSkeleton(problem, {"pick(hook)", "place(hook,table)", "pick(box)", "place(box,shelf)"});
  const ModeAssignments assignments = FindModeAssignments(facts, steps, 1000, Limits(facts.problem().search));
  // Two parts of the hook to grasp, two directions of the box.
  EXPECT_EQ(assignments.open.size() + assignments.refuted.size(), 4u);
  std::set<Variant> variants;
  double before = 0;
  for (const ModeAssignment& modes : assignments.open) {
    EXPECT_TRUE(variants.insert(modes.variant).second);
    EXPECT_LE(before, modes.predicted_cost);
    before = modes.predicted_cost;
    // A mode assignment's predicted cost is that of its program's guess.
    const KeyPoseProgram key_poses = BuildProgram(facts, steps, modes.variant);
    EXPECT_EQ(DescribeModeAssignment(facts, modes.variant, key_poses).predicted_cost, modes.predicted_cost);
  }
  const ModeAssignments few = FindModeAssignments(facts, steps, 2, Limits(facts.problem().search));
  EXPECT_EQ(few.open.size() + few.refuted.size(), 2u);
}

TEST(CheckerTest, RejectsAPlanOfOtherActions) {
  const Problem problem = ReachProblem();
  Plan plan;
  plan.actions = {"pick(box)"};
  EXPECT_THAT(
      [&] { CheckPlan(problem, plan); },
      ::testing::ThrowsMessage<InputError>(HasSubstr("the plan has 0 key poses, but its actions have 1")));
}

}  // namespace
}  // namespace tether::planning
