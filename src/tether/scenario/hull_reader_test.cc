#include "tether/geometry/hull/hull_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/scratch_folder.h"
#include "tether/common/document/value.h"
#include "tether/common/file.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/scenario/scene_reader.h"

namespace tether::scenario {
namespace {

using testing::HasSubstr;

const char* const kCube = R"(# a cube of side 2
v -1 -1 -1
v 1 -1 -1
v 1 1 -1
v -1 1 -1
v -1 -1 1
v 1 -1 1
v 1 1 1
v -1 1 1
f 4 3 2 1
f 5/1 6/1 7/1 8/1
f 1 2 6 5
f 2//1 3//1 7//1 6//1
f -6 -5 -1 -2
f 4 1 5 8
)";

/// The shape of a text, and what was wrong with it.
geometry::Shape Read(const std::string& yaml, std::string* mistakes, const std::string& folder = "") {
  Diagnostics diagnostics;
  const Value value = ParseYaml(yaml, "s.yaml");
  const geometry::Shape shape = ReadShape(value, "object 'o'", folder, diagnostics);
  for (const Diagnostic& diagnostic : diagnostics.list()) *mistakes += diagnostic.ToString() + "\n";
  return shape;
}

std::string MistakesOf(const std::string& yaml, const ScratchFolder& folder) {
  std::string mistakes;
  Read(yaml, &mistakes, folder.path().string());
  return mistakes;
}

TEST(HullReaderTest, AHullStandsAtItsCentreOfMass) {
  std::string mistakes;
  const geometry::Shape shape =
      Read("- hull: [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]]\n  pose: {position: [1, 0, 0]}", &mistakes);
  EXPECT_EQ(mistakes, "");
  EXPECT_LT((shape.parts[0].X_SP.p - Eigen::Vector3d(1.5, 0.5, 0.5)).norm(), 1e-12);
  EXPECT_NEAR(geometry::Volume(shape.parts[0].primitive), 8.0 / 6, 1e-12);
}

TEST(HullReaderTest, AMeshIsReadFromTextAndScaled) {
  const ScratchFolder folder;
  WriteFile(folder.File("cube.obj"), kCube);
  std::string mistakes;
  const geometry::Shape shape = Read("{mesh: cube.obj, scale: 0.1}", &mistakes, folder.path().string());
  EXPECT_EQ(mistakes, "");
  const auto& hull = std::get<geometry::Hull>(shape.parts[0].primitive);
  EXPECT_EQ(hull.polytope->faces.size(), 6u);
  EXPECT_NEAR(hull.polytope->volume, 0.008, 1e-12);
}

TEST(HullReaderTest, BadPointsAreExplainedWhereTheyStand) {
  const ScratchFolder folder;
  EXPECT_THAT(MistakesOf("{hull: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]}", folder),
              testing::AllOf(HasSubstr("s.yaml:1:"), HasSubstr("lie in one plane"),
                             HasSubstr("at least four points")));
  EXPECT_THAT(MistakesOf("{hull: [[0, 0, 0], [1, 0, 0], [0, 1, 0]]}", folder), HasSubstr("fewer than four"));
  EXPECT_THAT(MistakesOf("{hull: 3}", folder), HasSubstr("at least four points"));
  EXPECT_THAT(MistakesOf("{hull: [[0, 0, .nan], [1, 0, 0], [0, 1, 0], [0, 0, 1]]}", folder),
              HasSubstr("a point of hull"));
  EXPECT_THAT(MistakesOf("{box: [1, 1, 1], scale: 2}", folder), HasSubstr("unknown shape 'scale'"));
}

TEST(HullReaderTest, BadMeshesAreExplained) {
  const ScratchFolder folder;
  const auto with = [&](const std::string& name, const std::string& text) {
    WriteFile(folder.File(name), text);
    return MistakesOf("{mesh: " + name + "}", folder);
  };
  EXPECT_THAT(
      MistakesOf("{mesh: nowhere.obj}", folder),
      testing::AllOf(HasSubstr("s.yaml:1:"), HasSubstr("nowhere.obj"), HasSubstr("cannot read this file")));
  EXPECT_THAT(MistakesOf("{mesh: cube.dae}", folder), HasSubstr("ends with .obj or .stl"));
  EXPECT_THAT(with("empty.obj", "v 0 0 0\n"), HasSubstr("no triangles"));
  EXPECT_THAT(with("bad.obj", "v 0 0 0\nv 1 x 0\n"), HasSubstr("bad.obj:2:1: 'v 1 x 0' is not a point"));
  EXPECT_THAT(with("bad.obj", "v 0 0 0\nf 1 2 3\n"), HasSubstr("bad.obj:2:1: the face has the corner '2'"));
  EXPECT_THAT(with("bad.stl", "nonsense"), HasSubstr("not an STL file"));
  EXPECT_THAT(with("flat.stl", "solid\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"),
              HasSubstr("fewer than four"));
  std::string hollow = kCube;
  hollow += "v 0 0 -0.5\n";
  hollow.replace(hollow.find("f 5/1 6/1 7/1 8/1"), 17, "");
  hollow += "f 5 6 9\nf 6 7 9\nf 7 8 9\nf 8 5 9\n";
  EXPECT_THAT(with("hollow.obj", hollow), HasSubstr("is not convex: it fills 75 % of its hull"));
  WriteFile(folder.File("hollow.obj"), hollow);
  EXPECT_EQ(MistakesOf("{mesh: hollow.obj, fill: true}", folder), "");
}

}  // namespace
}  // namespace tether::scenario
