#include "tether/bench/campaigns/campaign.h"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/scratch_folder.h"
#include "tether/common/error.h"

namespace tether::bench {
namespace {

using ::testing::HasSubstr;

class CampaignTest : public ::testing::Test {
 protected:
  CampaignOptions Quality(int scenes) const {
    CampaignOptions options;
    options.name = "quality";
    options.kinds = {"stack"};
    options.scenes = scenes;
    options.restarts = 2;
    options.seed = 3;
    options.output = file_;
    return options;
  }
  std::vector<std::string> Lines() const {
    std::ifstream stream(file_);
    std::vector<std::string> lines;
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
  }
  static std::string Error(const CampaignOptions& options) {
    try {
      RunCampaign(options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }

  ScratchFolder folder_;
  const std::string file_ = folder_.File("campaign.jsonl");
};

TEST_F(CampaignTest, ARerunTakesUpWhereTheLastOneEnded) {
  const CampaignResult first = RunCampaign(Quality(1));
  ASSERT_EQ(first.records.size(), 1u);
  EXPECT_EQ(first.records[0].Find("status")->AsText(), "solved");
  const std::vector<std::string> before = Lines();
  ASSERT_EQ(before.size(), 2u);  // a header and a record

  std::ofstream(file_, std::ios::app) << R"({"kind":"stack","seed":4,"st)";  // killed while writing
  EXPECT_EQ(RunCampaign(Quality(2)).records.size(), 2u);
  const std::vector<std::string> after = Lines();
  ASSERT_EQ(after.size(), 3u);
  // Measured times would differ.
  EXPECT_EQ(after[0], before[0]);
  EXPECT_EQ(after[1], before[1]);
  EXPECT_THAT(after[2], HasSubstr(R"({"kind":"stack","seed":4,"blocks":4,"status":"solved")"));

  EXPECT_EQ(RunCampaign(Quality(2)).records.size(), 2u);
  EXPECT_EQ(Lines(), after);
}

TEST_F(CampaignTest, AnInterruptionKeepsWhatIsFinished) {
  std::atomic<bool> stop = false;
  CampaignOptions options = Quality(3);
  options.stop = &stop;
  const CampaignResult result = RunCampaign(options, [&](int, int, const Value&) { stop = true; });
  EXPECT_TRUE(result.interrupted);
  EXPECT_EQ(result.records.size(), 1u);
  EXPECT_EQ(Lines().size(), 2u);
}

TEST_F(CampaignTest, MeasuresTheSameTwiceButForTimes) {
  CampaignOptions options = Quality(1);
  options.output.clear();
  Value a = RunCampaign(options).records.at(0), b = RunCampaign(options).records.at(0);
  EXPECT_EQ(WriteJson(a.Set("plan_cpu_s", 0)), WriteJson(b.Set("plan_cpu_s", 0)));
  EXPECT_FALSE(std::filesystem::exists(file_));
}

TEST_F(CampaignTest, AFileOfAnotherCampaignIsRefused) {
  RunCampaign(Quality(1));
  CampaignOptions options = Quality(1);
  options.restarts = 3;
  EXPECT_THAT(Error(options), HasSubstr(file_ + ":1: this campaign has restarts '2' ('3', as asked for now"));
  options.name = "robustness";
  EXPECT_THAT(Error(options), HasSubstr("this campaign has name 'quality' ('robustness', as asked for now"));
  std::ofstream(file_) << "title: x\nseed: 3\n";
  EXPECT_THAT(Error(Quality(1)), HasSubstr(file_ + ":1: this campaign has format 'nothing'"));
}

TEST_F(CampaignTest, MistakesNameTheOptionAndWhatIsAccepted) {
  CampaignOptions options;
  options.name = "robustnes";
  options.kinds = {"hanoi"};
  options.scenes = 0;
  options.restarts = 0;
  const std::string error = Error(options);
  EXPECT_THAT(error, HasSubstr("unknown campaign 'robustnes' (did you mean 'robustness'? accepted: "));
  EXPECT_THAT(error, HasSubstr("--kind is 'hanoi' (reach or stack)"));
  EXPECT_THAT(error, HasSubstr("--scenes is 0 (1 or more)"));
  EXPECT_THAT(error, HasSubstr("--restarts is 0 (1 or more)"));
  options = {};
  options.name = "growth";
  options.kinds = {"reach"};
  EXPECT_THAT(Error(options), HasSubstr("--kind has no effect on campaign 'growth'"));
  options.command = "torque";
  EXPECT_THAT(Error(options), HasSubstr("--command has no effect on campaign 'growth'"));
  options = {};
  options.name = "control";
  options.command = "torques";
  EXPECT_THAT(Error(options), HasSubstr("--command is 'torques' (velocity or torque)"));
}

Value Parse(const std::string& text) { return ParseYaml(text, "record"); }

TEST(CampaignSummaryTest, SolvedIsAShareOfWhatCanBeSolved) {
  CampaignOptions options;
  options.name = "robustness";
  CampaignResult result;
  for (int i = 1; i <= 8; ++i) {
    result.records.push_back(Parse("{kind: reach, seed: " + std::to_string(i) +
                                   ", status: solved, plan_cpu_s: 0.01, cost: 1, solvable: true}"));
  }
  result.records.push_back(
      Parse("{kind: reach, seed: 9, status: gave_up, plan_cpu_s: 0.2, reason: why, "
            "restart_solved_at: 7, solvable: true}"));
  result.records.push_back(
      Parse("{kind: reach, seed: 10, status: gave_up, plan_cpu_s: 0.1, reason: why, "
            "restart_solved_at: 0, solvable: false}"));
  const Value summary = SummarizeCampaign(options, result);
  const Value& row = summary.Find("kinds")->items().at(0);
  EXPECT_EQ(row.Find("solvable")->integer(), 9);
  EXPECT_DOUBLE_EQ(row.Find("solved_share")->number(), 8.0 / 9);
  EXPECT_DOUBLE_EQ(row.Find("plan_cpu_s")->Find("p99_over_median")->number(), 20);
  EXPECT_EQ(row.Find("failures")->items().size(), 2u);
  const std::string table = CampaignTable(summary);
  EXPECT_THAT(table, HasSubstr("8 solved of 9 that can be (88.9 %)"));
  EXPECT_THAT(table, HasSubstr("seed 9: restart 7 solves it; why"));
  EXPECT_THAT(table, HasSubstr("seed 10: no restart solves it; why"));
}

TEST(CampaignSummaryTest, QualityCountsScenesThatOnlyRestartsSolveAsWorse) {
  CampaignOptions options;
  options.name = "quality";
  CampaignResult result;
  for (const char* rest :
       {"status: solved, cost: 1.009, restart_cost: 1", "status: solved, cost: 1.02, restart_cost: 1",
        "status: gave_up, restart_cost: 1", "status: solved, cost: 1", "status: gave_up"}) {
    result.records.push_back(
        Parse(std::string("{kind: stack, seed: 1, blocks: 4, plan_cpu_s: 0.01, ") + rest + "}"));
  }
  const Value summary = SummarizeCampaign(options, result);
  EXPECT_EQ(summary.Find("kinds")->items().at(0).Find("within_1_percent")->integer(), 3);
  EXPECT_THAT(CampaignTable(summary), HasSubstr("seed 1, 4 blocks: cost 1.0200, 2.0 % more"));
}

TEST(CampaignSummaryTest, WarmAndColdAreComparedWhereBothAreFeasible) {
  CampaignOptions options;
  options.name = "warm";
  CampaignResult result;
  for (const char* rest : {"cold: {feasible: true, cost: 1, cpu_s: 0.01}, "
                           "warm: {feasible: true, cost: 1.005, cpu_s: 0.004}",
                           "cold: {feasible: true, cost: 1, cpu_s: 0.01}, "
                           "warm: {feasible: true, cost: 0.9, cpu_s: 0.005}",
                           "cold: {feasible: true, cost: 1, cpu_s: 0.01}, "
                           "warm: {feasible: false, cost: 1, cpu_s: 0.001}",
                           "first_solve: none"}) {
    result.records.push_back(Parse(std::string("{kind: reach, seed: 1, status: solved, ") + rest + "}"));
  }
  const Value summary = SummarizeCampaign(options, result);
  const Value& row = summary.Find("kinds")->items().at(0);
  EXPECT_EQ(row.Find("compared")->integer(), 2);
  EXPECT_EQ(row.Find("same_cost")->integer(), 1);
  EXPECT_EQ(row.Find("only_cold_feasible")->integer(), 1);
  EXPECT_NEAR(row.Find("warm_over_cold_median")->number(), 0.4, 1e-12);
  EXPECT_THAT(CampaignTable(summary), HasSubstr("2 of 4 scenes solved both ways"));
}

TEST_F(CampaignTest, WarmStartsFromWhatWasFoundBeforeAnObjectMoved) {
  CampaignOptions options = Quality(1);
  options.name = "warm";
  const Value record = RunCampaign(options).records.at(0);
  ASSERT_NE(record.Find("warm"), nullptr) << WriteJson(record);
  EXPECT_TRUE(record.Find("cold")->Find("feasible")->boolean());
  EXPECT_TRUE(record.Find("warm")->Find("feasible")->boolean());
  EXPECT_GT(record.Find("moved_by_m")->number(), 0);
  EXPECT_LE(record.Find("moved_by_m")->number(), 0.05);
}

TEST(CampaignSummaryTest, GrowthComparesTimesPerStepObjectAndCandidate) {
  CampaignOptions options;
  options.name = "growth";
  CampaignResult result;
  result.records.push_back(
      Parse("{kind: hanoi, seed: 1, blocks: 3, status: solved, candidates: 2, steps: 14, live_objects: 3, "
            "optimize_cpu_s: 0.084, first_solve: {cpu_s: 0.042}}"));
  result.records.push_back(
      Parse("{kind: hanoi, seed: 1, blocks: 4, status: solved, candidates: 2, steps: 30, live_objects: 4, "
            "optimize_cpu_s: 0.72, first_solve: {cpu_s: 0.12}}"));
  const Value summary = SummarizeCampaign(options, result);
  const Value& row = summary.Find("kinds")->items().at(0);
  EXPECT_NEAR(row.Find("factor")->number(), 3, 1e-12);
  EXPECT_NEAR(row.Find("one_solve_factor")->number(), 1, 1e-12);
}

}  // namespace
}  // namespace tether::bench
