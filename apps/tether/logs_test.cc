// Logs of runs, as a user meets them: killed, on a full disk, of another format; judged again and reported.

#include <cstdlib>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/tether/cli_testing.h"

namespace tether {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class LogsTest : public ::testing::Test {
 protected:
  std::string Path(const std::string& name) const { return folder_.File(name); }
  static size_t Count(const std::string& text, const std::string& part) {
    size_t count = 0;
    for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
    return count;
  }
  ScratchFolder folder_;
};

TEST_F(LogsTest, RunIsJudgedAgainAndReported) {
  const std::string log = Path("run.mcap"), page = Path("run.html"), figure = Path("run.svg");
  ASSERT_EQ(Tether("run " + Scenario("press") + " --log '" + log + "'").exit_code, 0);
  const Outcome check = Tether("check '" + log + "'");
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
  EXPECT_THAT(check.out, HasSubstr("run.mcap: log, ok; Press a button, seed 1, "));
  EXPECT_EQ(Tether("report '" + log + "' --output '" + page + "'").exit_code, 0);
  EXPECT_THAT(ReadFile(page), HasSubstr("<!DOCTYPE html>"));
  EXPECT_THAT(ReadFile(page), HasSubstr("What happened"));
  EXPECT_EQ(Tether("report '" + log + "' --output '" + figure + "'").exit_code, 0);
  EXPECT_THAT(ReadFile(figure), HasSubstr("Room left: "));
  EXPECT_THAT(ReadFile(figure), HasSubstr(">Joints ("));
  // What it is judged by is in the log: the scenario may be elsewhere by then.
  const std::string copy = Path("scene.yaml"), moved = Path("moved.mcap");
  fs::copy_file(kSource + "/scenarios/stacking.yaml", copy);
  fs::copy(kSource + "/scenarios/stacking", Path("stacking"), fs::copy_options::recursive);
  const Outcome stopped = Tether("run '" + copy + "' --log '" + moved + "'", "timeout -s INT 3");
  fs::remove(copy);
  fs::remove_all(Path("stacking"));
  if (!fs::exists(moved)) GTEST_SKIP() << "it was stopped before it ran: " << stopped.err;
  EXPECT_THAT(Tether("check '" + moved + "'").out, HasSubstr("log, "));
}

TEST_F(LogsTest, KilledRunLeavesItsLog) {
  const std::string log = Path("run.mcap");
  const std::string script =
      "p=0; '" + std::string(TETHER_BINARY) + "' run " + Scenario("press") + " --realtime --log '" + log +
      "' > /dev/null 2>&1 & p=$!; while [ $(stat -c %s '" + log +
      "' 2> /dev/null || echo 0) -lt 60000 ] && kill -0 $p; do sleep 0.02; done; kill -9 $p; wait $p";
  EXPECT_NE(std::system(("{ " + script + "; } 2> /dev/null").c_str()), 0);
  const Outcome check = Tether("check '" + log + "'");
  EXPECT_EQ(check.exit_code, 5) << check.err;
  EXPECT_THAT(check.out, HasSubstr("it was cut off (byte "));
  EXPECT_THAT(check.out, HasSubstr("not to its end"));
  EXPECT_EQ(Tether("report '" + log + "' --output '" + Path("run.html") + "'").exit_code, 0);
  EXPECT_THAT(ReadFile(Path("run.html")), HasSubstr("before the run did"));
}

TEST_F(LogsTest, FullDiskIsSaidOnceAndTheRunGoesOn) {
  const std::string log = Path("run.mcap");
  const Outcome run = Tether("run " + Scenario("press") + " --log '" + log + "'", "ulimit -f 100;");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.out, HasSubstr("goal reached"));
  EXPECT_EQ(Count(run.err, "--log: cannot write " + log + ": File too large; the run goes on"), 1U)
      << run.err;
  EXPECT_THAT(run.err,
              HasSubstr("--log: " + log + " is not whole: File too large; the log has the run up to "));
  EXPECT_GT(fs::file_size(log), 10'000U);
  const Outcome check = Tether("check '" + log + "'");
  EXPECT_EQ(check.exit_code, 5);
  EXPECT_THAT(check.out, HasSubstr("the file ends without its index"));
}

TEST_F(LogsTest, OldFormatIsRefusedWithWhatToDo) {
  const std::string old = Path("old.log");
  WriteFile(old, "{\"format\": \"tether.log/1\", \"seed\": 3}");
  for (const std::string& command :
       {"check '" + old + "'", "report '" + old + "' --output '" + Path("x.svg") + "'"}) {
    const Outcome outcome = Tether(command);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err,
                HasSubstr("the log is in format 'tether.log/1', in which Tether no longer writes"));
    EXPECT_THAT(outcome.err, HasSubstr("run the scenario again with its seed"));
  }
}

TEST_F(LogsTest, CampaignBecomesAPage) {
  const std::string records = Path("c.jsonl"), summary = Path("c.json"), page = Path("c.html");
  ASSERT_EQ(Tether("campaign robustness --scenes 2 --kind reach --restarts 1 --output '" + records +
                   "' --json '" + summary + "'")
                .exit_code,
            0);
  ASSERT_EQ(Tether("report '" + records + "' --output '" + page + "'").exit_code, 0);
  EXPECT_THAT(ReadFile(page), HasSubstr("2 scenes, from seed 1"));
  EXPECT_THAT(ReadFile(page), HasSubstr("plan_cpu_s"));
  ASSERT_EQ(Tether("report '" + records + "' --output '" + Path("c.svg") + "'").exit_code, 0);
  EXPECT_THAT(ReadFile(Path("c.svg")), HasSubstr("Share of scenes up to cost"));
  EXPECT_EQ(Tether("report '" + summary + "' --output '" + page + "'").exit_code, 0);
  const Outcome none = Tether("report '" + summary + "' --output '" + Path("d.svg") + "'");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("a campaign's summary has nothing to draw (a file that ends with .html)"));
}

}  // namespace
}  // namespace tether
