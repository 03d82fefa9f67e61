// Logs of runs: written while the run goes on, read as far as they go, judged again.

#include <cmath>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/scratch_folder.h"
#include "testing/scenario/test_scenarios.h"
#include "tether/common/file.h"
#include "tether/evaluation/log/byte_queue.h"
#include "tether/evaluation/log/log_channels.h"
#include "tether/evaluation/log/log_check.h"
#include "tether/evaluation/log/log_stream.h"
#include "tether/evaluation/log/message_template.h"
#include "tether/evaluation/mcap/mcap_writer.h"
#include "tether/evaluation/report/run_page.h"
#include "tether/evaluation/run.h"
#include "tether/scenario/perturb.h"
#include "tether/scenario/problem.h"

namespace tether::evaluation {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(ByteQueue, KeepsOrderBetweenTwoThreads) {
  ByteQueue queue;
  constexpr int kEntries = 20000;
  std::thread writer([&] {
    for (int i = 0; i < kEntries; ++i) queue.Push(std::to_string(i), std::string(i % 97, 'x'));
  });
  std::string entry;
  for (int i = 0; i < kEntries;) {
    if (!queue.Pop(&entry)) continue;
    ASSERT_EQ(entry, std::to_string(i) + std::string(i % 97, 'x'));
    ++i;
  }
  writer.join();
  EXPECT_FALSE(queue.Pop(&entry));
  EXPECT_EQ(queue.backlog(), 0U);
  queue.Push("", std::string(1 << 20, 'y'));  // Larger than a block.
  ASSERT_TRUE(queue.Pop(&entry));
  EXPECT_EQ(entry.size(), size_t{1} << 20);
}

TEST(MessageTemplate, FillsNumbersAndTimes) {
  const MessageTemplate message("{\"t\":\x02,\"a\":\x01,\"b\":[\x01,\x01]}");
  ASSERT_EQ(message.num_numbers(), 3U);
  std::string text;
  message.Fill(1'250'000'000, std::vector<double>{-0.5, 1.0 / 3, std::nan("")}, &text);
  EXPECT_EQ(text, R"({"t":{"sec":1,"nsec":250000000},"a":-0.5,"b":[0.333333,null]})");
}

TEST(MessageTemplate, NumbersAreThoseOfJson) {
  for (const auto& [number, expected] :
       std::vector<std::pair<double, std::string>>{{0, "0"},
                                                   {-1e-9, "0"},
                                                   {-3, "-3"},
                                                   {12.5, "12.5"},
                                                   {-0.000001, "-0.000001"},
                                                   {1e12, "1e+12"},
                                                   {0.1 + 0.2, "0.3"},
                                                   {999999.9999999, "1000000"},
                                                   {HUGE_VAL, "null"}}) {
    std::string text;
    AppendNumber(number, &text);
    EXPECT_EQ(text, expected);
  }
}

struct Logged {
  RunReport report;
  RunLog log;
};

/// Plans and runs a shipped scene with a log.
Logged RunWithLog(const std::string& name, const std::string& path, const std::atomic<bool>* stop = nullptr) {
  const scenario::Scenario scenario = scenario::Shipped(name);
  const auto task = scenario::MakeTask(scenario);
  const scene::Scene scene = scenario::PerturbScene(scenario.scene, scenario.perturb, scenario.seed);
  const auto planned = planning::PlanTask(scenario::MakeProblem(scenario, scene, {}), *task);
  RunOptions options;
  options.seed = scenario.seed;
  options.log.path = path;
  options.stop = stop;
  Logged logged;
  logged.report = RunPlan(scenario, scene, *task, planned.best()->plan, options);
  logged.log = ReadRunLog(path, true);
  return logged;
}

class RunLogTest : public ::testing::Test {
 protected:
  std::string Path(const std::string& name) const { return folder_.File(name); }
  ScratchFolder folder_;
};

TEST_F(RunLogTest, HoldsTheWholeRun) {
  const Logged logged = RunWithLog("stacking", Path("run.mcap"));
  const RunLog& log = logged.log;
  ASSERT_EQ(logged.report.status, RunStatus::kSuccess);
  EXPECT_EQ(logged.report.log_problem, "");
  EXPECT_FALSE(log.problem);
  EXPECT_EQ(log.Metadata("seed"), "3");
  EXPECT_THAT(log.Metadata("tether"), HasSubstr("0.1.0"));
  EXPECT_THAT(log.Metadata("physics"), HasSubstr("MuJoCo "));
  EXPECT_EQ(log.events.size(), logged.report.events.size());
  EXPECT_EQ(log.plans.size(), 1U);
  // From the first moment to the last, with no gap.
  ASSERT_FALSE(log.samples.empty());
  EXPECT_EQ(log.samples.front().time, 0);
  EXPECT_NEAR(log.samples.back().time, logged.report.sim_time_s, 1e-9);
  for (size_t i = 1; i < log.samples.size(); ++i)
    EXPECT_LE(log.samples[i].time - log.samples[i - 1].time, 0.05 + 1e-6);
  for (const auto& [object, X_WO] : logged.report.final_X_WO)
    EXPECT_LE((log.samples.back().X_WO.at(object).p - X_WO.p).norm(), 2e-6) << object;
  // The least margin of the run is the least of its intervals: no tick between samples is lost.
  for (const Margin& margin : logged.report.margins) {
    double least = HUGE_VAL;
    for (const LogSeries& series : log.series) {
      if (series.name != margin.name) continue;
      for (const double value : series.values) least = std::isfinite(value) ? std::min(least, value) : least;
    }
    if (margin.minimum > 1e200) continue;
    EXPECT_NEAR(least, margin.minimum, 1e-6 * std::max(1.0, least)) << margin.name;
  }
  EXPECT_THAT(WriteRunPage(log), HasSubstr("Stacking"));
}

TEST_F(RunLogTest, IsJudgedAgain) {
  const Logged logged = RunWithLog("stacking", Path("run.mcap"));
  const Judgement again = JudgeLog(logged.log);
  EXPECT_TRUE(again.goal_reached);
  ASSERT_EQ(again.facts.size(), logged.report.judgement.facts.size());
  for (size_t i = 0; i < again.facts.size(); ++i) {
    EXPECT_EQ(again.facts[i].atom, logged.report.judgement.facts[i].atom);
    EXPECT_EQ(again.facts[i].holds, logged.report.judgement.facts[i].holds);
  }
  FileCheck check;
  CheckRunLog(Path("run.mcap"), check);
  EXPECT_THAT(check.problems, IsEmpty());
  // A part of it is a run that has not reached its goal.
  const std::string bytes = ReadFile(Path("run.mcap"));
  WriteFile(Path("part.mcap"), std::string_view(bytes).substr(0, bytes.size() / 4));
  FileCheck part;
  CheckRunLog(Path("part.mcap"), part);
  EXPECT_THAT(part.problems, Contains(HasSubstr("it was cut off")));
  EXPECT_THAT(part.notes, Contains("by its samples the goal was not reached"));
}

TEST_F(RunLogTest, OfARunThatWasStoppedSaysSo) {
  const std::atomic<bool> stop = true;
  RunWithLog("stacking", Path("run.mcap"), &stop);
  FileCheck check;
  CheckRunLog(Path("run.mcap"), check);
  EXPECT_THAT(check.problems, Contains("the run ended as interrupted"));
}

TEST_F(RunLogTest, WhatIsNoLogIsRefusedWithWhatToDo) {
  const auto problem = [](const std::string& bytes) -> std::string {
    try {
      ParseRunLog(bytes, "a.log");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(
      problem("{\"format\": \"tether.log/1\", \"seed\": 3}"),
      HasSubstr(
          "a.log: the log is in format 'tether.log/1', in which Tether no longer writes and reads logs (an "
          "MCAP file: run the scenario again with its seed"));
  EXPECT_THAT(problem("hello"), HasSubstr("it does not begin as an MCAP file does"));
  EXPECT_THAT(problem(""),
              HasSubstr("the file holds nothing of a run: the file ends within its first bytes (byte 0)"));
  McapWriter foreign("another program");
  foreign.Finish();
  EXPECT_THAT(problem(foreign.Take()), HasSubstr("it has no metadata 'tether'"));
  McapWriter later("tether of tomorrow");
  later.AddMetadata(kLogMetadata, {{"format", "tether.log/3"}});
  later.Finish();
  EXPECT_THAT(problem(later.Take()),
              HasSubstr("the log is in format 'tether.log/3' (metadata record at byte 43)"));
}

TEST_F(RunLogTest, AFullDiskIsSaidAndEndsNothing) {
  LogPreamble preamble{"test", kLogMetadata, {{"format", kLogFormat}}, {}, LogChannels()};
  LogStream stream("/dev/full", preamble);
  for (int i = 0; i < 100; ++i) stream.WriteText(kMarks, 0.01 * i, R"({"kind":"grasped","text":"a"})");
  EXPECT_THAT(stream.Close(), HasSubstr("No space left on device; the log has the run up to 0.00 s"));
  EXPECT_THROW(LogStream("/nowhere/run.mcap", preamble), InputError);
}

TEST_F(RunLogTest, TwoRunsDoNotWriteOneFile) {
  const LogPreamble preamble{"test", kLogMetadata, {{"format", kLogFormat}}, {}, LogChannels()};
  LogStream first(Path("run.mcap"), preamble);
  try {
    LogStream second(Path("run.mcap"), preamble);
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("another run writes it"));
  }
  EXPECT_EQ(first.Close(), "");
  EXPECT_FALSE(ReadRunLog(Path("run.mcap")).problem);
}

}  // namespace
}  // namespace tether::evaluation
