#include "tether/scenario/generators/generate.h"

#include <filesystem>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/scratch_folder.h"
#include "tether/common/document/value.h"
#include "tether/common/error.h"
#include "tether/common/file.h"
#include "tether/evaluation/check.h"
#include "tether/geometry/polygon/support.h"
#include "tether/planning/plan/problem.h"
#include "tether/planning/program/frame_tree.h"
#include "tether/planning/replan/optimum.h"
#include "tether/scenario/problem.h"

namespace tether::evaluation {
namespace {

using ::testing::HasSubstr;

/// FNV-1a.
uint64_t Hash(const scenario::GeneratedScenario& generated) {
  uint64_t hash = 0xcbf29ce484222325u;
  for (const std::string* text : {&generated.scenario, &generated.domain, &generated.problem}) {
    for (char c : *text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  }
  return hash;
}

std::vector<std::pair<std::string, scenario::GeneratorParameters>> Sizes() {
  std::vector<std::pair<std::string, scenario::GeneratorParameters>> all;
  for (int blocks = 2; blocks <= 8; ++blocks) {
    all.push_back({"hanoi", {blocks, 0, 0}});
    all.push_back({"stack", {blocks, 0, 0}});
  }
  all.push_back({"reach", {}});
  for (int objects : {1, 5, 8}) {
    for (int regions = 1; regions <= 4; ++regions) all.push_back({"sort", {0, objects, regions}});
  }
  for (int objects : {0, 6, 12}) all.push_back({"clutter", {0, objects, 0}});
  for (int objects : {1, 6, 8}) all.push_back({"bin", {0, objects, 0}});
  for (int objects : {0, 6, 100}) all.push_back({"crowd", {0, objects, 0}});
  for (int blocks = 1; blocks <= 4; ++blocks) all.push_back({"around", {blocks, 0, 0}});
  for (int objects : {0, 6, 12}) all.push_back({"posts", {0, objects, 0}});
  for (int objects : {1, 4, 6}) {
    for (int regions : {1, 2}) all.push_back({"shelf", {0, objects, regions}});
  }
  return all;
}

TEST(GenerateTest, GeometryAndInitialStateAgreeInEveryScene) {
  for (const auto& [kind, parameters] : Sizes()) {
    for (uint64_t seed = 0; seed < (kind == "reach" ? 60 : 6); ++seed) {
      const scenario::Scenario scenario = scenario::LoadGenerated(scenario::Generate(kind, parameters, seed));
      for (const std::string& problem : CheckGeometry(scenario)) {
        ADD_FAILURE() << kind << " " << parameters.blocks << " " << parameters.objects << " "
                      << parameters.regions << " seed " << seed << ": " << problem;
      }
      EXPECT_EQ(scenario.seed, seed);
      EXPECT_EQ(scenario.planning.solver, nlp::Backend::kNative);
    }
  }
}

TEST(GenerateTest, TheSameSeedGivesTheSameTextsAndAnotherOnesOthers) {
  for (const auto& [kind, parameters] : Sizes()) {
    EXPECT_EQ(Hash(scenario::Generate(kind, parameters, 5)), Hash(scenario::Generate(kind, parameters, 5)));
    EXPECT_NE(Hash(scenario::Generate(kind, parameters, 5)), Hash(scenario::Generate(kind, parameters, 6)));
  }
}

// A change here is a change of the distributions in docs/generators.md, and of every figure measured on them.
TEST(GenerateTest, TheScenesOfSeedOneAreWhatTheyWere) {
  const std::map<std::string, uint64_t> pinned = {
      {"hanoi", 0x84d0d0121e256a58u}, {"reach", 0x93978feb7718d0e6u},   {"stack", 0xa4227c521295cdedu},
      {"sort", 0x79ef6a617339b706u},  {"clutter", 0x451d64eb6bcb9679u}, {"bin", 0x1656809c0c2807bbu},
      {"crowd", 0x3e91ee35c034558cu}, {"around", 0x8ce4e06f9ea86d82u},  {"posts", 0x13a1111de97dbeddu},
      {"shelf", 0xfd44c8a26e2a6dbcu}};
  for (const auto& [kind, text] : scenario::GeneratorKinds()) {
    EXPECT_EQ(Hash(scenario::Generate(kind, {}, 1)), pinned.at(kind))
        << kind << ":\n"
        << scenario::Generate(kind, {}, 1).scenario;
  }
  const scenario::Scenario reach = scenario::LoadGenerated(scenario::Generate("reach", {}, 1));
  EXPECT_TRUE(reach.scene.InitialPose("box").p.isApprox(Eigen::Vector3d(0.886, 0.066, 0.029), 1e-12));
  EXPECT_TRUE(reach.scene.InitialPose("hook").p.isApprox(Eigen::Vector3d(0.552, -0.293, 0.012), 1e-12));
}

TEST(GenerateTest, HanoiHasTheSizesAndLengthThatItsNumberOfBlocksAsksFor) {
  for (int blocks = 2; blocks <= 8; ++blocks) {
    const scenario::Scenario scenario =
        scenario::LoadGenerated(scenario::Generate("hanoi", {blocks, 0, 0}, 1));
    EXPECT_EQ(scenario.task.max_actions, 2 * ((1 << blocks) - 1));
    std::vector<double> edges;
    for (const scene::Object& object : scenario.scene.objects) {
      if (!object.movable()) continue;
      edges.push_back(std::get<geometry::Box>(object.shape.parts.front().primitive).size.x());
    }
    ASSERT_EQ(static_cast<int>(edges.size()), blocks);
    EXPECT_NEAR(edges.front(), 0.07, 1e-9);
    EXPECT_NEAR(edges.back(), 0.03, 1e-9);
    for (size_t i = 1; i < edges.size(); ++i) EXPECT_LT(edges[i], edges[i - 1] - 0.002);
  }
}

TEST(GenerateTest, ReachScenesHaveTheBoxBeyondReachInThreeOfFour) {
  int beyond = 0;
  const int scenes = 200;
  for (uint64_t seed = 0; seed < scenes; ++seed) {
    const scenario::Scenario scenario = scenario::LoadGenerated(scenario::Generate("reach", {}, seed));
    const Eigen::Vector2d p = scenario.scene.InitialPose("box").p.head<2>();
    const bool far = p.norm() > 0.83;
    const symbolic::Problem& problem = *scenario.problem;
    bool stated = false;
    for (const symbolic::Fact& fact : problem.init) {
      stated = stated || (problem.domain->predicates[fact.predicate].name == "inworkspace" &&
                          problem.objects[fact.arguments[0]].name == "box");
    }
    EXPECT_EQ(far, !stated) << "seed " << seed;
    EXPECT_EQ(scenario.task.max_actions, far ? 5 : 2);
    beyond += far ? 1 : 0;
  }
  EXPECT_NEAR(beyond, 0.75 * scenes, 20);
}

TEST(GenerateTest, MistakesNameTheValueAndWhatIsAccepted) {
  const auto message = [](const std::string& kind,
                          const scenario::GeneratorParameters& parameters) -> std::string {
    try {
      scenario::Generate(kind, parameters, 1);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(message("hanoi", {9, 6, 2}), HasSubstr("--blocks is 9 (2 to 8: "));
  EXPECT_THAT(message("stack", {1, 6, 2}), HasSubstr("--blocks is 1 (2 to 8: "));
  EXPECT_THAT(message("sort", {3, 0, 5}), HasSubstr("--objects is 0 (1 to 8: "));
  EXPECT_THAT(message("sort", {3, 0, 5}), HasSubstr("--regions is 5 (1 to 4: "));
  EXPECT_THAT(message("clutter", {3, 13, 2}), HasSubstr("--objects is 13 (0 to 12: "));
  EXPECT_THAT(message("around", {5, 6, 2}), HasSubstr("--blocks is 5 (1 to 4: "));
  EXPECT_THAT(message("posts", {3, 13, 2}), HasSubstr("--objects is 13 (0 to 12: "));
  EXPECT_THAT(message("shelf", {3, 7, 3}), HasSubstr("--regions is 3 (1 to 2: "));
  EXPECT_THAT(message("shelf", {3, 7, 3}), HasSubstr("--objects is 7 (1 to 6: "));
  EXPECT_THAT(message("bin", {3, 9, 2}), HasSubstr("--objects is 9 (1 to 8: "));
  EXPECT_THAT(message("crowd", {3, 201, 2}), HasSubstr("--objects is 201 (0 to 200: "));
  EXPECT_THAT(message("hanio", {}),
              HasSubstr("unknown kind of scene 'hanio' (did you mean 'hanoi'? accepted: "));
}

class FolderTest : public ::testing::Test {
 protected:
  ScratchFolder scratch_;
  const std::filesystem::path folder_ = scratch_.path() / "new" / "scene";
};

TEST_F(FolderTest, WrittenFilesAreReadAsTheTextsAre) {
  const scenario::GeneratedScenario generated = scenario::Generate("sort", {0, 4, 2}, 3);
  const std::string path = scenario::WriteGenerated(generated, folder_.string(), false);
  EXPECT_EQ(ReadFile(path), generated.scenario);
  const std::vector<FileCheck> checks = CheckFiles({path});
  ASSERT_EQ(checks.size(), 1u);
  EXPECT_TRUE(checks[0].problems.empty()) << checks[0].problems[0];
}

TEST_F(FolderTest, NothingIsReplacedUnasked) {
  scenario::WriteGenerated(scenario::Generate("hanoi", {}, 1), folder_.string(), false);
  const std::string before = ReadFile((folder_ / "scenario.yaml").string());
  try {
    scenario::WriteGenerated(scenario::Generate("reach", {}, 1), folder_.string(), false);
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_EQ(error.diagnostics().size(), 3u);
    EXPECT_THAT(error.what(), HasSubstr("scenario.yaml' exists already (another folder, or --force"));
  }
  EXPECT_EQ(ReadFile((folder_ / "scenario.yaml").string()), before);
  scenario::WriteGenerated(scenario::Generate("reach", {}, 1), folder_.string(), true);
  EXPECT_NE(ReadFile((folder_ / "scenario.yaml").string()), before);
}

/// After the plan, for each block of the tower, the centre of mass of what stands on it is over that block.
void ExpectBalanced(const scenario::Scenario& scenario, const planning::Plan& plan) {
  const scene::Frames frames(scenario.scene);
  planning::FrameTree tree(frames, scenario.scene, {});
  std::vector<math::Pose> poses;
  for (const planning::PlanStep& step : plan.steps) {
    ASSERT_TRUE(tree.AddStep(frames.Find(step.control), frames.Find(step.target)));
    poses.push_back(step.X_TC);
  }
  const int last = tree.num_steps() - 1;
  for (const scene::Object& base : scenario.scene.objects) {
    if (!base.movable()) continue;
    double mass = 0;
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    for (const scene::Object& other : scenario.scene.objects) {
      if (other.name == base.name || !other.movable() ||
          !tree.HangsOn(frames.Find(other.name), frames.Find(base.name), last))
        continue;
      mass += *other.mass;
      moment += *other.mass *
                (tree.PoseAt(frames.Find(other.name), last, poses) * geometry::CentreOfMass(other.shape));
    }
    if (mass == 0) continue;
    const Eigen::Vector3d p_B =
        tree.PoseAt(frames.Find(base.name), last, poses).Inverse() * Eigen::Vector3d(moment / mass);
    const auto& box = std::get<geometry::Box>(base.shape.parts[0].primitive);
    EXPECT_LT(std::abs(p_B.x()), box.size.x() / 2 - 0.002) << base.name;
    EXPECT_LT(std::abs(p_B.y()), box.size.y() / 2 - 0.002) << base.name;
  }
}

TEST(GenerateTest, TowersAreBalancedOnEveryLevel) {
  for (const uint64_t seed : {2, 3, 7, 26, 31}) {
    const scenario::Scenario scenario = scenario::LoadGenerated(scenario::Generate("stack", {5, 0, 0}, seed));
    scenario::PlanningOverrides overrides;
    overrides.threads = 1;
    const planning::PlanReport report = planning::PlanTask(
        scenario::MakeProblem(scenario, scenario.scene, overrides), *scenario::MakeTask(scenario));
    ASSERT_NE(report.best(), nullptr) << seed;
    ExpectBalanced(scenario, report.best()->plan);
  }
}

/// A scene in which most mode assignments of each candidate fail, and candidates with a common prefix fail
/// alike.
planning::PlanReport PlanHardScene(const scenario::PlanningOverrides& overrides) {
  const scenario::Scenario scenario = scenario::LoadGenerated(scenario::Generate("reach", {}, 111));
  return planning::PlanTask(scenario::MakeProblem(scenario, scenario.scene, overrides),
                            *scenario::MakeTask(scenario));
}

TEST(GenerateTest, WhatCandidatesLearnOfTheirBeginningsDoesNotDependOnThreads) {
  scenario::PlanningOverrides overrides;
  overrides.no_robot = true;
  overrides.threads = 1;
  const planning::PlanReport one = PlanHardScene(overrides);
  overrides.threads = 3;
  const planning::PlanReport three = PlanHardScene(overrides);
  ASSERT_TRUE(one.ok());
  ASSERT_EQ(one.candidates.size(), three.candidates.size());
  for (size_t i = 0; i < one.candidates.size(); ++i) {
    EXPECT_EQ(one.candidates[i].status, three.candidates[i].status);
    EXPECT_EQ(one.candidates[i].plan.cost, three.candidates[i].plan.cost);
    EXPECT_EQ(one.candidates[i].evaluations, three.candidates[i].evaluations);
  }
}

TEST(GenerateTest, TheLimitOfIterationsHolds) {
  const scenario::Scenario scenario = scenario::LoadGenerated(scenario::Generate("reach", {}, 111));
  scenario::PlanningOverrides overrides;
  overrides.no_robot = true;
  const auto iterations = [&] {
    const planning::Problem problem = scenario::MakeProblem(scenario, scenario.scene, overrides);
    const planning::SceneFacts facts(problem);
    const auto steps = planning::BindSkeleton(problem, {"pick(hook)", "push(hook,box,table)"});
    planning::KeyPoseProgram key_poses = planning::BuildProgram(facts, steps);
    return planning::SolveKeyPoses(facts, steps, planning::Limits(problem.search), 1000, nullptr, key_poses)
        .iterations;
  };
  EXPECT_GT(iterations(), 3);
  overrides.max_iterations = 3;
  EXPECT_EQ(iterations(), 3);
  overrides.max_iterations = 0;
  EXPECT_THROW(iterations(), InputError);
}
}  // namespace
}  // namespace tether::evaluation
