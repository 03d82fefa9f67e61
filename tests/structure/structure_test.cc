#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "structure/source_tree.h"

namespace tether::structure {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const std::vector<File>& Tree() {
  static const std::vector<File> files = ReadTree(TETHER_SOURCE_DIR);
  return files;
}

std::string TableText() {
  for (const File& file : Tree()) {
    if (file.path == "docs/architecture.md") return file.text;
  }
  return "";
}

RoomTable Table() { return ParseRoomTable(TableText()); }

TEST(Structure, TreeAndTableAreFound) {
  EXPECT_GT(std::count_if(Tree().begin(), Tree().end(), [](const File& f) { return f.path.ends_with(".h"); }),
            15);
  EXPECT_THAT(Table(), SizeIs(20));
  EXPECT_THAT(Table()["qp"], ElementsAre("common"));
  EXPECT_THAT(Table()["common"], IsEmpty());
  EXPECT_THAT(CheckTable(Table()), IsEmpty());
}

TEST(Structure, RoomsKnowOnlyWhatTheTableAllows) {
  EXPECT_THAT(CheckRoomIncludes(Tree(), Table()), IsEmpty());
  EXPECT_THAT(CheckRoomTargets(Tree(), Table()), IsEmpty());
}

TEST(Structure, FoldersAreThoseOfTheTableAndSmall) {
  EXPECT_THAT(ParseFolderTable(TableText())["task"], ElementsAre("goal", "heuristics", "search", "symmetry"));
  EXPECT_THAT(CheckFolders(Tree(), ParseFolderTable(TableText()), 25), IsEmpty());
}

TEST(Structure, EveryEdgeOfTheTableIsUsed) {
  RoomTable table = Table();
  table.erase("perception");      // Its place is kept; it has no code yet.
  table["math"].erase("common");  // Its tests draw random numbers.
  EXPECT_THAT(CheckEdgesAreUsed(Tree(), table), IsEmpty());
}

TEST(Structure, HeadersAreLight) {
  EXPECT_THAT(CheckHeaderIncludes(Tree()), IsEmpty());
  EXPECT_THAT(CheckHeaderManners(Tree()), IsEmpty());
  EXPECT_THAT(CheckOwnHeaderFirst(Tree()), IsEmpty());
}

TEST(Structure, FilesAndFunctionsAreShort) {
  EXPECT_THAT(CheckFileLengths(Tree(), 500), IsEmpty());
  EXPECT_THAT(CheckFunctionLengths(Tree(), 80), IsEmpty());
}

TEST(Structure, NoFileNamesAMachine) { EXPECT_THAT(CheckMachinePaths(Tree()), IsEmpty()); }

// The rules themselves: each finds an offender.

const RoomTable kTable{{"common", {}}, {"math", {"common"}}, {"geometry", {"math"}}, {"qp", {"common"}}};

TEST(StructureRules, ReachableIncludesWhatOthersKnow) {
  EXPECT_THAT(Reachable(kTable, "geometry"), ElementsAre("common", "geometry", "math"));
}

TEST(StructureRules, TableWithACircleOrAStrangerIsFound) {
  EXPECT_THAT(CheckTable({{"a", {"b"}}, {"b", {"a"}}}), SizeIs(2));
  EXPECT_THAT(CheckTable({{"a", {"b"}}}), ElementsAre("the table lets a know b, which is not a room"));
}

TEST(StructureRules, ForbiddenRoomIsFound) {
  const std::string upwards = "#include <vector>\n  #  include \"tether/geometry/shape.h\"\n";
  EXPECT_THAT(CheckRoomIncludes({{"src/tether/math/a.cc", upwards}}, kTable),
              ElementsAre("src/tether/math/a.cc:2: math may not know geometry"));
  EXPECT_THAT(
      CheckRoomIncludes({{"src/tether/geometry/a.cc", "#include \"tether/common/error.h\"\n"}}, kTable),
      IsEmpty());
  EXPECT_THAT(CheckRoomIncludes({{"src/tether/qp/a_test.cc", "#include \"tether/math/pose.h\"\n"}}, kTable),
              ElementsAre(HasSubstr("qp may not know math")));
  EXPECT_THAT(CheckRoomIncludes({{"src/tether/util/a.h", ""}}, kTable),
              ElementsAre(HasSubstr("'util' is not a room")));
  EXPECT_THAT(CheckRoomIncludes({{"apps/tether/main.cc", upwards}}, kTable), IsEmpty());
}

TEST(StructureRules, HelpersOfTestsAreForTestsOfRoomsThatMayKnowThem) {
  const std::string helper = "#include \"testing/math/random_pose.h\"\n";
  EXPECT_THAT(CheckRoomIncludes({{"src/tether/geometry/a_test.cc", helper}}, kTable), IsEmpty());
  EXPECT_THAT(CheckRoomIncludes({{"src/tether/geometry/a.cc", helper}}, kTable),
              ElementsAre("src/tether/geometry/a.cc:1: \"testing/math/random_pose.h\" is for tests only"));
  EXPECT_THAT(CheckRoomIncludes({{"src/tether/qp/a_test.cc", helper}}, kTable),
              ElementsAre(HasSubstr("qp may not know math")));
  EXPECT_THAT(CheckRoomIncludes({{"testing/math/a.h", "#include \"tether/geometry/shape.h\"\n"}}, kTable),
              ElementsAre(HasSubstr("math may not know geometry")));
}

TEST(StructureRules, FoldersThatTheTableDoesNotNameOrThatAreFullAreFound) {
  const FolderTable folders{{"math", {"lie"}}};
  EXPECT_THAT(CheckFolders({{"src/tether/math/lie/a.h", ""}}, folders, 1), IsEmpty());
  EXPECT_THAT(CheckFolders({{"src/tether/math/lie/a.h", ""}, {"src/tether/math/lie/a.cc", ""}}, folders, 1),
              ElementsAre("src/tether/math/lie holds 2 sources, more than 1"));
  EXPECT_THAT(CheckFolders({{"src/tether/math/lie/a.h", ""}, {"src/tether/math/other/a.h", ""}}, folders, 1),
              ElementsAre("the table does not name math's folder other"));
  EXPECT_THAT(CheckFolders({}, folders, 1), ElementsAre("the table names math/lie, which is not there"));
}

TEST(StructureRules, EdgeThatOnlyTestsUseIsFound) {
  const std::string math = "#include \"tether/math/pose.h\"\n";
  EXPECT_THAT(CheckEdgesAreUsed({{"src/tether/geometry/a.cc", math}}, {{"geometry", {"math"}}}), IsEmpty());
  EXPECT_THAT(CheckEdgesAreUsed({{"src/tether/geometry/a_test.cc", math}}, {{"geometry", {"math"}}}),
              ElementsAre("no source of geometry includes math"));
}

TEST(StructureRules, ForbiddenTargetIsFound) {
  EXPECT_THAT(CheckRoomTargets(
                  {{"src/tether/math/CMakeLists.txt", "tether_room(math KNOWS common geometry)"}}, kTable),
              ElementsAre("src/tether/math/CMakeLists.txt:1: math may not know geometry"));
  EXPECT_THAT(
      CheckRoomTargets({{"src/tether/math/CMakeLists.txt", "tether_room(math KNOWS common\n THIRD_PARTY x)"}},
                       kTable),
      IsEmpty());
}

TEST(StructureRules, ThirdPartyHeaderInHeaderIsFound) {
  const std::string text =
      "#pragma once\n#include <Eigen/Core>\n#include <vector>\n#include <mujoco/mujoco.h>\n";
  EXPECT_THAT(CheckHeaderIncludes({{"src/tether/sim/world.h", text}}),
              ElementsAre("src/tether/sim/world.h:4: <mujoco/mujoco.h> belongs in a .cc file"));
  EXPECT_THAT(
      CheckHeaderIncludes({{"src/tether/sim/world.h", "#include \"pose.h\"\n#include <nlopt.hpp>\n"}}),
      SizeIs(2));
  EXPECT_THAT(CheckHeaderIncludes({{"src/tether/sim/world.cc", text}}), IsEmpty());
}

TEST(StructureRules, OwnHeaderThatIsNotFirstIsFound) {
  const File header{"src/tether/math/a.h", "#pragma once\n"};
  EXPECT_THAT(CheckOwnHeaderFirst(
                  {header, {"src/tether/math/a.cc", "\n#include <vector>\n#include \"tether/math/a.h\"\n"}}),
              ElementsAre("src/tether/math/a.cc:2: \"tether/math/a.h\" comes first"));
  EXPECT_THAT(CheckOwnHeaderFirst({header, {"src/tether/math/a.cc", "#include \"tether/math/a.h\"\n"}}),
              IsEmpty());
  EXPECT_THAT(CheckOwnHeaderFirst({header, {"src/tether/math/b.cc", "#include <vector>\n"}}), IsEmpty());
}

TEST(StructureRules, BadMannersInHeadersAreFound) {
  EXPECT_THAT(CheckHeaderManners({{"a.h", "#pragma once\n// using namespace std\nusing namespace std;\n"}}),
              ElementsAre(HasSubstr("a.h:3: `using namespace`")));
  EXPECT_THAT(CheckHeaderManners({{"a.h", "#include <iostream>\n"}}), SizeIs(2));
}

TEST(StructureRules, MachinePathIsFound) {
  const std::string slash = "/";
  EXPECT_THAT(CheckMachinePaths({{"a.md", "x\nsee " + slash + "home/somebody\n"}}),
              ElementsAre(HasSubstr("a.md:2:")));
  EXPECT_THAT(CheckMachinePaths({{"a.md", ".." + slash + "shared/x"}}), SizeIs(1));
  EXPECT_THAT(CheckMachinePaths({{"a.md", "/usr/include, /dev/null, build/tmp.txt"}}), IsEmpty());
}

TEST(StructureRules, LongFileWithoutAReasonIsFound) {
  EXPECT_THAT(CheckFileLengths({{"a.cc", "int a;\nint b;\n"}}, 2), IsEmpty());
  EXPECT_THAT(CheckFileLengths({{"a.cc", "int a;\nint b;\nint c;\n"}}, 2),
              ElementsAre(HasSubstr("a.cc has 3 lines, more than 2")));
  EXPECT_THAT(CheckFileLengths({{"a.cc", "// Long: a table.\nint b;\nint c;\n"}}, 2), IsEmpty());
  EXPECT_THAT(CheckFileLengths({{"a.md", "1\n2\n3\n"}}, 2), IsEmpty());
}

TEST(StructureRules, LongFunctionIsFound) {
  const std::string text =
      "namespace a {\n"
      "struct B {\n  int c;\n  int d;\n  int e;\n};\n"  // a long type is none
      "const int kF[] = {\n  1,\n  2,\n};\n"            // nor is a table
      "int Short() {\n  return 1;\n}\n"
      "const char* Text() {\n  return R\"({{\n)\";  // {\n}\n"
      "TEST(X, Y) {\n  if (Short()) {\n    Short();\n  }\n}\n"
      "}\n";
  EXPECT_THAT(CheckFunctionLengths({{"a.cc", text}}, 4),
              ElementsAre("a.cc:18: a function of 5 lines, more than 4"));
  EXPECT_THAT(CheckFunctionLengths({{"a.cc", text}}, 5), IsEmpty());
}

}  // namespace
}  // namespace tether::structure
