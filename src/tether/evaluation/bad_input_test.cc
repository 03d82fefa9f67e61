// Finds about scenarios and files with which a command crashed or did not end.

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/scratch_folder.h"
#include "testing/scenario/test_scenarios.h"
#include "tether/common/file.h"
#include "tether/common/output/record_file.h"
#include "tether/common/random.h"
#include "tether/evaluation/check.h"
#include "tether/evaluation/report/figure.h"
#include "tether/evaluation/report/run_page.h"
#include "tether/geometry/box_tree.h"
#include "tether/scenario/problem.h"

namespace tether::evaluation {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

class BadInputTest : public ::testing::Test {
 protected:
  static std::string Text(const std::string& name) {
    return ReadFile(std::string(TETHER_SOURCE_DIR) + "/" + name);
  }
  std::string Write(const std::string& name, const std::string& text) const {
    fs::create_directories(fs::path(folder_.File(name)).parent_path());
    WriteFile(folder_.File(name), text);
    return folder_.File(name);
  }
  std::string ErrorOf(const std::string& scenario) const {
    try {
      CheckFiles({Write("s.yaml", scenario)});
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  ScratchFolder folder_;
};

TEST_F(BadInputTest, NothingIsAcceptedWhereNothingIs) {
  EXPECT_THAT(ErrorOf("format: tether.scenario/1\nobjects:\n  box: {shape: {box: [1, 1, 1]}}\nevents:\n"
                      "  - {when: {starts: place(box)}, move: {object: box, by: [0, 1, 0], over: 1}}\n"),
              HasSubstr("unknown action 'place' in event (accepted: none, since there is none)"));
}

TEST_F(BadInputTest, NegativeCapacitySegfault) {
  const std::string scene = Text("scenarios/assistive.yaml");
  for (const char* capacity : {"-1", "-2147483647", "-9223372036854775808"}) {
    const std::string error = ErrorOf(Replaced(scene, "heat: {disc: 0.06, capacity: 1",
                                               std::string("heat: {disc: 0.06, capacity: ") + capacity));
    EXPECT_THAT(error, HasSubstr("'capacity' of region 'heat' is")) << capacity;
  }
  EXPECT_THAT(ErrorOf(Replaced(scene, "dwell: 5", "dwell: -5")),
              HasSubstr("'dwell' of region 'person_1' is negative"));
  EXPECT_THAT(ErrorOf(Replaced(scene, "disc: 0.06", "disc: -0.06")),
              HasSubstr("'disc' of region 'person_1' is '-0.06'"));
}

// What no controller can keep is said before a run.
TEST_F(BadInputTest, LimitsThatCannotBeKept) {
  const std::string scene =
      Replaced(Text("scenarios/workspace_reach.yaml"), "domain: workspace_reach/",
               "domain: " + std::string(TETHER_SOURCE_DIR) + "/scenarios/workspace_reach/");
  const std::string whole =
      Replaced(scene, "problem: workspace_reach/",
               "problem: " + std::string(TETHER_SOURCE_DIR) + "/scenarios/workspace_reach/");
  EXPECT_EQ(ErrorOf(whole), "");
  // A start beyond a limit.
  EXPECT_THAT(ErrorOf(Replaced(whole, "-2.6180, 0, 2.0944", "-0.01, 0, 2.0944")),
              AllOf(HasSubstr("s.yaml:"), HasSubstr("has -0.01 for joint4, beyond the joint's limits")));
  // Limits that contradict each other.
  const auto with = [&](const std::string& constraint) {
    return ErrorOf(Replaced(whole,
                            "constraints:                          # hold at every key pose; `moved` is what "
                            "the hand moves there\n",
                            "constraints:\n- " + constraint + "\n"));
  };
  EXPECT_EQ(with("joint_limits: {margin: 0.1}"), "");
  EXPECT_THAT(with("joint_limits: {margin: 1.6}"),
              HasSubstr("leaves joint4 of 'panda' no room between its limits"));
  EXPECT_THAT(with("tilt: {frame: hand, from: z, max: 4}"), HasSubstr("allows any direction"));
  EXPECT_THAT(with("clearance: {of: [links], to: [table], distance: -0.01}"), HasSubstr("'distance' of"));
  // Constraints on frames that there are not, or that the arm does not carry.
  EXPECT_THAT(with("tilt: {frame: hnd, from: z, max: 0.3}"),
              AllOf(HasSubstr("'hnd', which the arm does not carry"), HasSubstr("did you mean 'hand'?")));
  EXPECT_THAT(with("tilt: {frame: table, from: z, max: 0.3}"), HasSubstr("'table'"));
  EXPECT_THAT(with("clearance: {of: [links], to: [tabel], distance: 0.01}"),
              AllOf(HasSubstr("names 'tabel' in 'to'"), HasSubstr("did you mean 'table'?")));
  EXPECT_THAT(
      with("outside: {frame: hand, cylinder: 0.1, around: shlf}"),
      AllOf(HasSubstr("names 'shlf', which is not in the scene"), HasSubstr("did you mean 'shelf'?")));
}

TEST_F(BadInputTest, LargeCapacityHang) {
  const std::string scene = Text("scenarios/assistive.yaml");
  // As many places as there are objects, or more, are one and the same.
  const auto atoms = [&](const std::string& capacity) {
    const scenario::Scenario scenario =
        scenario::LoadScenario(Write("s.yaml", Replaced(scene, "heat: {disc: 0.06, capacity: 1",
                                                        "heat: {disc: 0.06, capacity: " + capacity)));
    return scenario::MakeTask(scenario)->atoms().size();
  };
  EXPECT_EQ(atoms("2147483647"), atoms("4"));
  EXPECT_EQ(atoms("100000"), atoms("5"));
  EXPECT_GT(atoms("4"), atoms("3"));
}

TEST_F(BadInputTest, ShiftEndlessWay) {
  Write("models/actions/manipulation.yaml", Text("models/actions/manipulation.yaml"));
  const std::string library = Text("models/actions/manipulation.yaml");
  const size_t shift = library.find("shift: {by: [");
  ASSERT_NE(shift, std::string::npos);
  const size_t begin = shift + std::string("shift: {by: [").size(), end = library.find(']', begin);
  for (const char* by : {"0, 1e308, -0.1", "1e155, 0, 0", "0, 0, -10001"}) {
    const std::string bent = library.substr(0, begin) + by + library.substr(end);
    try {
      CheckFiles({Write("actions.yaml", bent)});
      ADD_FAILURE() << by;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("'by' of verb 'shift' has the entry")) << by;
      EXPECT_THAT(error.what(), HasSubstr("numbers from -10000 to 10000")) << by;
    }
  }
}

TEST_F(BadInputTest, HugeCylinderEndlessDistance) {
  const std::string robot = Text("models/robots/panda.yaml"), mjcf = Text("models/robots/panda.xml");
  const std::string scene =
      Replaced(Text("scenarios/workspace_reach.yaml"), "model: panda", "model: ./robot/panda.yaml");
  const std::string place = "size=\"0.045\" fromto=\"0 0 0.02 0 0 0.107\"";
  Write("robot/panda.yaml", robot);
  for (const char* bent :
       {"size=\"1e308\" fromto=\"0 0 0.02 0 0 0.107\"", "size=\"10001\" fromto=\"0 0 0.02 0 0 0.107\"",
        "size=\"0.045\" fromto=\"0 0 0.02 0 0 1e6\""}) {
    Write("robot/panda.xml", Replaced(mjcf, place, bent));
    EXPECT_THAT(ErrorOf(scene), HasSubstr("is beyond 10 km (lengths of a robot, m")) << bent;
  }
  // Shapes of the scene, and where they are.
  std::string shapes = Text("scenarios/hanoi.yaml");
  shapes.replace(shapes.find("objects:"),
                 shapes.find('\n', shapes.find("objects:")) - shapes.find("objects:"), "objects:");
  for (const char* shape :
       {"{cylinder: {radius: 1e308, length: 1}}", "{cylinder: {radius: 1, length: 10001}}", "{sphere: 1e300}",
        "{capsule: {radius: 1e-300, length: 1}}"}) {
    EXPECT_THAT(
        ErrorOf(Replaced(shapes, "objects:\n", std::string("objects:\n  big: {shape: ") + shape + "}\n")),
        HasSubstr("a length from 0.1 mm to 10 km is accepted"))
        << shape;
  }
  EXPECT_THAT(ErrorOf(Replaced(shapes, "objects:\n", "objects:\n  thin: {shape: {box: [1, 1e-300, 1]}}\n")),
              HasSubstr("box of object 'thin' has the size 1e-300 (full side lengths from 0.1 mm, m"));
  EXPECT_THAT(
      ErrorOf(Replaced(shapes, "objects:\n", "objects:\n  light: {shape: {sphere: 1}, mass: 1e-9}\n")),
      HasSubstr("'mass' of object 'light' is 1e-9 kg (a mass from 1 mg"));
  EXPECT_THAT(ErrorOf(Replaced(shapes, "objects:\n",
                               "objects:\n  far: {shape: {sphere: 1}, pose: {position: [0, 1e9, 0]}}\n")),
              HasSubstr("numbers from -10000 to 10000 (m or rad) are accepted"));
}

TEST_F(BadInputTest, CheckQuadraticObjects) {
  // The tree finds the same pairs as a comparison of all.
  Random random(5);
  std::vector<geometry::Aabb> boxes;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d p(random.Uniform(0, 10), random.Uniform(0, 10), random.Uniform(0, 1));
    const double size = i % 50 == 0 ? 8 : random.Uniform(0, 1);
    boxes.push_back({p, p + Eigen::Vector3d(size, size * random.Uniform(0, 1), 0.1)});
  }
  boxes.push_back(boxes.front());
  const geometry::BoxTree tree(boxes);
  for (const geometry::Aabb& box : boxes) {
    std::vector<size_t> expected;
    for (size_t j = 0; j < boxes.size(); ++j) {
      if (box.DistanceTo(boxes[j]) == 0) expected.push_back(j);
    }
    EXPECT_EQ(tree.Meeting(box), expected);
  }
  EXPECT_TRUE(geometry::BoxTree().Meeting(boxes[0]).empty());
  // A row of blocks, one of which hangs in the air, and two overlap.
  scenario::Scenario scenario = scenario::Shipped("workspace_reach");
  scenario.problem = nullptr;
  for (int i = 0; i < 400; ++i) {
    scene::Object block;
    block.name = "block_" + std::to_string(i);
    block.shape = geometry::Shape(geometry::Box{Eigen::Vector3d(0.01, 0.01, 0.01)});
    block.mass = 0.01;
    block.X_ParentObject.p =
        Eigen::Vector3d(3 + 0.02 * (i % 20), 0.02 * (i / 20), 0.005 + (i == 7 ? 0.05 : 0));
    if (i == 31) block.X_ParentObject.p.x() -= 0.015;
    scenario.scene.objects.push_back(block);
  }
  scene::Object floor;
  floor.name = "floor";
  floor.shape = geometry::Shape(geometry::Box{Eigen::Vector3d(2, 2, 0.1)});
  floor.X_ParentObject.p = Eigen::Vector3d(3, 0, -0.05);
  scenario.scene.objects.push_back(floor);
  EXPECT_THAT(CheckGeometry(scenario),
              ::testing::ElementsAre(
                  HasSubstr("objects 'block_30' and 'block_31' overlap by 5.0 mm"),
                  HasSubstr("object 'block_7' rests on nothing: it is 50.0 mm from 'floor' below it")));
}

TEST_F(BadInputTest, CheckAcceptsWhatRunRefuses) {
  const std::string scene =
      Replaced(Text("scenarios/workspace_reach.yaml"), "model: panda", "model: ./robot/panda.yaml");
  Write("robot/panda.yaml", Text("models/robots/panda.yaml"));
  Write("robot/panda.xml",
        Replaced(Text("models/robots/panda.xml"), "<worldbody>", "<include file=\"more.xml\"/><worldbody>"));
  Write("robot/more.xml", "<mujoco><size nuser_geom=\"1\"/></mujoco>");
  for (const char* folder : {"domain.pddl", "problem.pddl"})
    Write(std::string("workspace_reach/") + folder, Text(std::string("scenarios/workspace_reach/") + folder));
  EXPECT_THAT(ErrorOf(scene), HasSubstr("the section 'include' can't be put into a scene"));
}

TEST_F(BadInputTest, RecordsAreOneWritersAtATime) {
  const std::string path = folder_.File("records");
  const Value header = Value::Object().Set("format", "x").Set("seed", 1);
  {
    RecordFile file(path, header);
    file.Append(Value::Object().Set("a", 1));
    EXPECT_THROW(RecordFile(path, header), InputError);
  }
  WriteFile(folder_.File("part"), ReadFile(path) + "{\"a\":");
  for (const char* name : {"records", "part"}) {
    RecordFile file(folder_.File(name), header);
    ASSERT_EQ(file.earlier().size(), 1u) << name;
    EXPECT_EQ(ReadFile(folder_.File(name)), "{\"format\":\"x\",\"seed\":1}\n{\"a\":1}\n");
  }
  // A header that was cut off is ours, too; anything else is not.
  WriteFile(path, "{\"format\":\"x\",");
  { RecordFile file(path, header); }
  EXPECT_EQ(ReadFile(path), "{\"format\":\"x\",\"seed\":1}\n");
  WriteFile(path, "{\"format\":\"y\",");
  EXPECT_THROW(RecordFile(path, header), InputError);
  EXPECT_EQ(ReadFile(path), "{\"format\":\"y\",");
  fs::create_symlink("records", folder_.File("link"));
  WriteFile(path, "");
  { RecordFile file(folder_.File("link"), header); }
  EXPECT_TRUE(fs::is_symlink(folder_.File("link")));
  try {
    RecordFile file("/dev/full", header);
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("No space left on device"));
  }
}

TEST_F(BadInputTest, LogsOfAnyNumbersAreDrawn) {
  const double none = std::nan("");
  for (const std::vector<double>& numbers : std::vector<std::vector<double>>{
           {1e308, -1e308}, {1e9, 1000000000.0000001}, {0, none}, {1e-300, 2e-300}, {5e8, 5e8}, {}}) {
    RunLog log;
    log.series.push_back({"a", "m", "p", numbers, numbers, 0, 0});
    EXPECT_THAT(DrawRunLog(log), HasSubstr("</svg>"));
    EXPECT_THAT(WriteRunPage(log), HasSubstr("</html>"));
  }
}

}  // namespace
}  // namespace tether::evaluation
