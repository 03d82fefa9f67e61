// The library in a program whose locale writes commas.

#include <clocale>
#include <cstdlib>
#include <locale>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/scratch_folder.h"
#include "testing/scenario/test_scenarios.h"
#include "tether/common/file.h"
#include "tether/common/text.h"
#include "tether/evaluation/check.h"
#include "tether/evaluation/log/message_template.h"
#include "tether/evaluation/report/figure.h"
#include "tether/geometry/hull/mesh_file.h"
#include "tether/scenario/problem.h"

namespace tether::evaluation {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// A German locale, made anew: few machines have one.
class LocaleTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string made =
        "localedef -i de_DE -f UTF-8 '" + folder_.File("de_DE.UTF-8") + "' > /dev/null 2>&1";
    if (std::system(made.c_str()) < 0) GTEST_SKIP() << "no localedef";
    setenv("LOCPATH", folder_.path().c_str(), 1);
    if (std::setlocale(LC_ALL, "de_DE.UTF-8") == nullptr) GTEST_SKIP() << "no German locale";
    char text[16];
    std::snprintf(text, sizeof text, "%.1f", 1.5);
    ASSERT_STREQ(text, "1,5");
  }
  void TearDown() override {
    std::setlocale(LC_ALL, "C");
    unsetenv("LOCPATH");
  }

  ScratchFolder folder_;
};

TEST_F(LocaleTest, LibraryIsLocaleDependent) {
  // Meshes, robots, and the simulated world of a scene.
  EXPECT_TRUE(CheckFiles({std::string(TETHER_SOURCE_DIR) + "/scenarios/parts.yaml"})[0].problems.empty());
  WriteFile(folder_.File("t.obj"), "v 0.5 0 0\nv 0 1.5e-1 0\nv 0 0 1\nf 1 2 3\n");
  EXPECT_EQ(geometry::ReadMesh(folder_.File("t.obj")).points[1].y(), 0.15);
  EXPECT_EQ(Format("%.2f", 0.25), "0.25");
  RunLog log;
  log.series.push_back({"a", "m", "p", {0, 1.5}, {0.25, 0.75}, 0, 0});
  const std::string svg = DrawRunLog(log);
  std::string number;
  AppendNumber(0.25, &number);
  EXPECT_EQ(number, "0.25");
  EXPECT_THAT(svg, HasSubstr(">0.6<"));
  EXPECT_THAT(svg, Not(HasSubstr(">0,6<")));
  // Plans are the same, digit by digit.
  const auto cost = [] {
    const scenario::Scenario scenario = scenario::Shipped("stacking");
    scenario::PlanningOverrides overrides;
    overrides.max_plans = 1;
    const planning::PlanReport report = planning::PlanTask(
        scenario::MakeProblem(scenario, scenario.scene, overrides), *scenario::MakeTask(scenario));
    return report.best() == nullptr ? 0.0 : report.best()->plan.cost;
  };
  const double here = cost();
  std::setlocale(LC_ALL, "C");
  EXPECT_EQ(here, cost());
}

}  // namespace
}  // namespace tether::evaluation
