#include "tether/sim/composer.h"

#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/scratch_folder.h"
#include "testing/sim/test_scenes.h"
#include "tether/common/document/value.h"
#include "tether/common/error.h"
#include "tether/common/file.h"
#include "tether/geometry/hull/polytope.h"

namespace tether::sim {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// The Panda with a piece of its MJCF replaced, built into a world; the message if that fails.
std::string BuildReplaced(const std::string& from, const std::string& to) {
  const ScratchFolder folder;
  const fs::path shipped = fs::path(robot::DataDirectory()) / "models" / "robots";
  std::string mjcf = ReadFile((shipped / "panda.xml").string());
  EXPECT_NE(mjcf.find(from), std::string::npos) << from;
  mjcf.replace(mjcf.find(from), from.size(), to);
  WriteFile(folder.File("panda.xml"), mjcf);
  WriteFile(folder.File("panda.yaml"), ReadFile((shipped / "panda.yaml").string()));
  scene::Scene scene;
  scene.robots = {MakePanda()};
  std::string message;
  try {
    World(scene, {{"panda", robot::Model::Load(folder.File("panda.yaml"))}}).Apply({}, 0.001);
  } catch (const InputError& error) {
    message = error.what();
  }
  return message;
}

TEST(ComposerTest, SectionsThatTheSceneReplacesAreLeftOut) {
  EXPECT_EQ(BuildReplaced("<contact>", R"(<actuator><motor joint="joint1"/></actuator>
      <sensor><jointpos joint="joint1"/></sensor>
      <keyframe><key qpos="0 0 0 -1 0 1 0 0 0"/></keyframe>
      <contact>)"),
            "");
}

TEST(ComposerTest, WhatCannotBeBuiltInIsExplained) {
  EXPECT_THAT(BuildReplaced("<compiler angle=\"radian\"", "<compiler angle=\"radian\" eulerseq=\"XYZ\""),
              testing::AllOf(HasSubstr("panda.xml:"), HasSubstr("eulerseq is 'XYZ'")));
  EXPECT_THAT(BuildReplaced("<contact>", "<visual/><custom/><size/><statistic/><contact>"), "");
}

TEST(ComposerTest, NamesWithMarkupAreNames) {
  scene::Scene scene;
  scene.objects = {MakeObject("<\"a\" & b>", geometry::Sphere{0.02}, {0, 0, 1}, 0.3)};
  World world(scene, {});
  world.Apply({}, 0.01);
  EXPECT_LT(world.Truth().X_WO.at("<\"a\" & b>").p.z(), 1);
}

TEST(ComposerTest, AHullRestsOnTheTableAndOnABlock) {
  const auto wedge = [](double length) {
    return *geometry::MakeHull({{0, 0, 0},
                                {length, 0, 0},
                                {length, 0.06, 0},
                                {0, 0.06, 0},
                                {0, 0.01, 0.05},
                                {0.03, 0.01, 0.05},
                                {0.03, 0.05, 0.05},
                                {0, 0.05, 0.05}})
                .hull;
  };
  scene::Scene scene;
  scene.objects = {MakeTable(), MakeObject("wedge", wedge(0.08), {0.4, 0, 0.001}, 0.2),
                   MakeObject("block", geometry::Box{{0.1, 0.1, 0.04}}, {0.4, 0.3, 0.02}, 0.3),
                   MakeObject("upper", wedge(0.06), {0.37, 0.27, 0.041}, 0.1)};
  World world(scene, {});
  for (int i = 0; i < 1000; ++i) world.Apply({}, 0.001);
  const std::map<std::string, math::Pose> settled = world.Truth().X_WO;
  for (int i = 0; i < 1000; ++i) world.Apply({}, 0.001);
  for (const char* name : {"wedge", "upper"}) {
    const math::Pose& X = world.Truth().X_WO.at(name);
    EXPECT_LT((X.p - settled.at(name).p).norm(), 5e-4) << name;
    EXPECT_GT(X.R(2, 2), 1 - 1e-5) << name << " lies flat";
  }
  EXPECT_NEAR(world.Truth().X_WO.at("wedge").p.z(), 0, 5e-4);
  EXPECT_NEAR(world.Truth().X_WO.at("upper").p.z(), 0.04, 5e-4);
}

}  // namespace
}  // namespace tether::sim
