// What commands write, and where: the finds about outputs, as a user meets them.

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/tether/cli_testing.h"
#include "tether/common/document/value.h"

namespace tether {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class OutputsTest : public ::testing::Test {
 protected:
  std::string Path(const std::string& name) const { return folder_.File(name); }
  Outcome Automaton(const std::string& json, const std::string& redirection = "") const {
    return Tether("automaton 'F a' --json '" + json + "' " + redirection);
  }

  ScratchFolder folder_;
};

TEST_F(OutputsTest, OutputReplacesDeviceOrSymlink) {
  // In the scratch folder, never in /dev: only root may make one.
  const std::string null = Path("null");
  if (mknod(null.c_str(), S_IFCHR | 0666, makedev(1, 3)) == 0) {
    EXPECT_EQ(Automaton(null).exit_code, 0);
    EXPECT_TRUE(fs::is_character_file(null));
  }
  fs::create_symlink("target.json", Path("link.json"));
  EXPECT_EQ(Automaton(Path("link.json")).exit_code, 0);
  EXPECT_TRUE(fs::is_symlink(Path("link.json")));
  EXPECT_THAT(ReadFile(Path("target.json")), HasSubstr("tether.automaton/1"));
  // Standard output by name is a pipe here, and carries the table too.
  const Outcome named = Automaton("/dev/stdout");
  EXPECT_EQ(named.exit_code, 0);
  EXPECT_THAT(named.out, HasSubstr("tether.automaton/1"));
  EXPECT_THAT(named.out, HasSubstr("state"));
  const Outcome full = Automaton("/dev/full");
  EXPECT_EQ(full.exit_code, 2);
  EXPECT_THAT(full.err, HasSubstr("No space left on device"));
}

TEST_F(OutputsTest, WhatIsReadIsNotWrittenTo) {
  const std::string scene = Path("s.yaml");
  fs::copy_file(kSource + "/scenarios/workspace_reach.yaml", scene);
  fs::create_symlink("s.yaml", Path("link.yaml"));
  const std::string before = ReadFile(scene);
  for (const char* option : {"--json", "--output", "--trace"}) {
    const Outcome outcome = Tether("plan '" + scene + "' " + option + " '" + Path("link.yaml") + "'");
    EXPECT_EQ(outcome.exit_code, 2) << option;
    EXPECT_THAT(outcome.err,
                HasSubstr(std::string(option) + ": " + Path("link.yaml") + " is a file that is read"));
  }
  EXPECT_EQ(ReadFile(scene), before);
  const Outcome twice = Tether("plan '" + scene + "' --json '" + Path("o") + "' --output '" +
                               folder_.path().string() + "/./o'");
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_THAT(twice.err, HasSubstr("--json and --output are both"));
  const Outcome both = Tether("run '" + scene + "' --json - --log -");
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_THAT(both.err, HasSubstr("--json and --log are both -"));
}

TEST_F(OutputsTest, OneOutputByTwoNames) {
  fs::create_directory(Path("sub"));
  fs::create_directory_symlink(".", Path("here"));
  const std::string in = "cd '" + folder_.path().string() + "';";
  for (const std::string& other :
       {std::string("./a.json"), std::string("sub/../a.json"), std::string("here/a.json"), Path("a.json")}) {
    const std::string names = "a.json --json '" + other + "'";
    for (const std::string& command :
         {"plan " + Scenario("stacking") + " --output ", "plan " + Scenario("stacking") + " --trace ",
          "run " + Scenario("stacking") + " --log ",
          std::string("campaign robustness --scenes 1 --kind reach --restarts 1 --output ")}) {
      const Outcome outcome = Tether(command + names, in);
      EXPECT_EQ(outcome.exit_code, 2) << command << names;
      EXPECT_THAT(outcome.err, HasSubstr("are both")) << command << names;
      EXPECT_FALSE(fs::exists(Path("a.json")));
    }
  }
}

TEST_F(OutputsTest, EmptyValuesAreRefused) {
  const std::string task =
      "task '" + kSource + "/scenarios/hanoi/domain.pddl' '" + kSource + "/scenarios/hanoi/problem.pddl'";
  for (const std::string& command : {task, "plan " + Scenario("stacking"), "run " + Scenario("stacking")}) {
    for (const char* formula : {"''", "' '"}) {
      const Outcome goal = Tether(command + " --goal " + formula);
      EXPECT_EQ(goal.exit_code, 2) << command;
      EXPECT_THAT(goal.err, HasSubstr("the formula is empty")) << command;
    }
    for (const char* option : {"--json", "--search", "--semantics"}) {
      const Outcome outcome = Tether(command + " " + option + " ''");
      EXPECT_EQ(outcome.exit_code, 2) << command << option;
      EXPECT_THAT(outcome.err, HasSubstr(std::string(option) + ": the value is empty")) << command;
    }
    const Outcome nan = Tether(command + " --time-limit nan");
    EXPECT_EQ(nan.exit_code, 2) << command;
    EXPECT_THAT(nan.err, HasSubstr("--time-limit is not a number")) << command;
  }
}

TEST_F(OutputsTest, CheckReadsEachFileOnce) {
  // Two pipes, each of which can be read once.
  WriteFile(Path("s.yaml"),
            "format: tether.scenario/1\nobjects:\n  t: {shape: {box: [1, 1, 1]}}\n"
            "robots: {panda: {model: panda, pose: {position: [0, 0, 2]}}}\n");
  const std::string in = "cd '" + folder_.path().string() + "'; mkfifo one two; ";
  const std::string library = kSource + "/models/actions/manipulation.yaml";
  const std::string writers = "(cat '" + library + "' > one) 3>&- & (cat s.yaml > two) 3>&- & ";
  const Outcome outcome = Tether("check one two < /dev/null", in + "exec 3>&1; exec > /dev/null; " + writers +
                                                                  "exec >&3 3>&-; timeout 20");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("two: scenario, ok"));
}

TEST_F(OutputsTest, StdoutWriteErrorsIgnored) {
  for (const std::string command : {"automaton 'F a' --json -", "automaton 'F a'", "automaton 'F a' --hoa",
                                    "automaton 'F a' --dot", "--help", "--version", "check --help"}) {
    for (const char* redirection : {"> /dev/full", ">&-"}) {
      const Outcome outcome = Tether(command + " " + redirection);
      EXPECT_EQ(outcome.exit_code, 2) << command << redirection;
      EXPECT_THAT(outcome.err, HasSubstr("cannot write to standard output")) << command << redirection;
    }
  }
  const Outcome check = Tether("check " + Scenario("hanoi") + " > /dev/full");
  EXPECT_EQ(check.exit_code, 2);
  // A file that is opened does not become standard output because that is closed.
  EXPECT_EQ(Automaton(Path("o.json"), ">&-").exit_code, 2);
  EXPECT_EQ(ParseYaml(ReadFile(Path("o.json")), "o").Find("format")->AsText(), "tether.automaton/1");
}

TEST_F(OutputsTest, CampaignOutputDestroysFile) {
  const std::string campaign = "campaign robustness --scenes 1 --kind reach --restarts 1 --output ";
  for (const std::string text : {"a note without an end", "two lines,\nthe last without an end",
                                 "{\"a\": 1}\nx", "PNG\r\n\x1a\n", "{\"format\":\"tether.campaign_rec"}) {
    WriteFile(Path("notes"), text);
    const Outcome outcome = Tether(campaign + "'" + Path("notes") + "'");
    if (text.starts_with("{\"format")) continue;  // an unfinished campaign: continued
    EXPECT_EQ(outcome.exit_code, 2) << text;
    EXPECT_EQ(ReadFile(Path("notes")), text);
  }
}

TEST_F(OutputsTest, SeedBeyondInt64) {
  const std::string plan = "plan " + Scenario("stacking") + " --max-plans 1 --json - --seed ";
  const Outcome greatest = Tether(plan + "18446744073709551615");
  EXPECT_EQ(greatest.exit_code, 0);
  EXPECT_EQ(ParseYaml(greatest.out, "o").Find("seed")->natural(), UINT64_MAX);
  for (const char* seed : {"18446744073709551616", "-1", "1e3", "''"}) {
    const Outcome beyond = Tether(plan + seed);
    EXPECT_EQ(beyond.exit_code, 2) << seed;
    EXPECT_THAT(beyond.err, HasSubstr("a whole number from 0 to 18446744073709551615")) << seed;
  }
}

}  // namespace
}  // namespace tether
