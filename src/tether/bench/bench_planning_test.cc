#include "tether/bench/bench_planning.h"

#include <atomic>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/needs_plugin.h"
#include "tether/common/error.h"

namespace tether::bench {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string Path(const std::string& name) {
  return std::string(TETHER_SOURCE_DIR) + "/scenarios/" + name + ".yaml";
}

/// The number under a path of keys; NaN for null or nothing.
double Number(const Value& value, const std::vector<std::string>& keys) {
  const Value* here = &value;
  for (const std::string& key : keys) {
    here = here->Find(key);
    if (here == nullptr) break;
  }
  return here == nullptr || here->is_null() ? std::nan("") : here->number();
}

std::string Text(const Value& value, const std::string& key) {
  return value.Find(key) == nullptr ? "" : value.Find(key)->AsText();
}

TEST(PlanningBenchTest, ARowPerProblemAndSolverOnTheSamePrograms) {
  TETHER_NEEDS_PLUGIN("ipopt");
  PlanningBenchOptions options;
  options.scenarios = {Path("tool_use")};
  options.solvers = {"native", "ipopt"};
  options.repetitions = 2;
  int called = 0;
  const PlanningBench bench = BenchmarkPlanning(options, [&](const ProblemMeasurement& problem) {
    ++called;
    EXPECT_THAT(PlanningBenchTable(problem), HasSubstr("ipopt"));
  });
  EXPECT_EQ(called, 1);
  EXPECT_FALSE(bench.interrupted);

  // What is written reads back.
  const Value json = ParseYaml(WriteJson(WritePlanningBench(bench)), "bench.json");
  ASSERT_GE(json.members().size(), 3u);
  EXPECT_EQ(json.members()[0].key, "format");
  EXPECT_EQ(json.members()[1].key, "tether");
  EXPECT_EQ(json.members()[2].key, "seed");
  EXPECT_EQ(Text(json, "format"), "tether.bench/1");
  EXPECT_EQ(Text(json, "name"), "planning");
  ASSERT_NE(json.Find("rows"), nullptr);
  const std::vector<Value>& rows = json.Find("rows")->items();
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(Text(rows[0], "solver"), "native");
  EXPECT_EQ(Text(rows[1], "solver"), "ipopt");
  EXPECT_EQ(Number(rows[0], {"repetitions"}), 2);
  EXPECT_EQ(Number(rows[1], {"repetitions"}), 1);
  EXPECT_EQ(Number(rows[0], {"ratio_to_native"}), 1);
  EXPECT_GT(Number(rows[1], {"ratio_to_native"}), 0);
  for (const Value& row : rows) {
    EXPECT_EQ(Text(row, "problem"), "Tool Use");
    EXPECT_EQ(Number(row, {"solved"}), 2);
    for (const char* key : {"optimize_s", "optimize_cpu_s"}) {
      EXPECT_GT(Number(row, {key, "median"}), 0) << key;
      EXPECT_GE(Number(row, {key, "p99"}), Number(row, {key, "median"})) << key;
    }
    EXPECT_GT(Number(row, {"cost"}), 0);
    EXPECT_LT(Number(row, {"max_violation_m"}), 1e-3);
    EXPECT_LT(Number(row, {"max_violation_rad"}), 5e-3);
    EXPECT_GE(Number(row, {"cost_excess"}), 0);
    ASSERT_NE(row.Find("share"), nullptr);
    double shares = 0;
    for (const Value::Member& share : row.Find("share")->members()) {
      if (share.value.is_null()) continue;
      EXPECT_GE(share.value.number(), 0) << share.key;
      shares += share.value.number();
    }
    EXPECT_NEAR(shares, 1, 1e-9);
    const std::vector<Value>& programs = row.Find("programs")->items();
    ASSERT_EQ(programs.size(), 2u);
    double iterations = 0, evaluations = 0;
    for (const Value& program : programs) {
      EXPECT_EQ(Text(program, "status"), "solved");
      EXPECT_GT(Number(program, {"solve_s", "median"}), 0);
      iterations += Number(program, {"iterations"});
      evaluations += Number(program, {"evaluations"});
    }
    EXPECT_EQ(Number(row, {"iterations"}), iterations);
    EXPECT_EQ(Number(row, {"evaluations"}), evaluations);
    EXPECT_EQ(Text(*row.Find("planning"), "status"), "solved");
    EXPECT_GT(Number(row, {"planning", "total_s", "median"}),
              Number(row, {"planning", "optimize_s", "median"}));
    EXPECT_NEAR(Number(row, {"planning", "cost"}), Number(row, {"cost"}), 1e-3);
  }
  const std::vector<Value>& problems = json.Find("problems")->items();
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_EQ(Number(problems[0], {"candidates"}), 2);
  EXPECT_GT(Number(problems[0], {"rows"}), Number(problems[0], {"variables"}));
  EXPECT_GT(Number(problems[0], {"build_s", "median"}), 0);
  EXPECT_EQ(problems[0].Find("process_s"), nullptr) << "no program was given";
}

TEST(PlanningBenchTest, CostsAreComparedProgramByProgram) {
  const auto program = [](double cost, nlp::Status status) {
    ProgramMeasurement measurement;
    measurement.result.cost = cost;
    measurement.result.status = status;
    return measurement;
  };
  using enum nlp::Status;
  ProblemMeasurement problem;
  problem.solvers.resize(3);
  problem.solvers[0].programs = {program(2, kSolved), program(3, kSolved)};
  problem.solvers[1].programs = {program(1, kSolved), program(3.3, kSolved)};
  problem.solvers[2].programs = {program(0.5, kFailed), program(3, kSolved)};
  EXPECT_DOUBLE_EQ(problem.CostExcess(problem.solvers[0]), 1);
  EXPECT_NEAR(problem.CostExcess(problem.solvers[1]), 0.1, 1e-12);
  EXPECT_TRUE(std::isinf(problem.CostExcess(problem.solvers[2])));
  EXPECT_EQ(problem.solvers[2].cost(), 3);
}

TEST(PlanningBenchTest, OthersAreAskedLessOften) {
  EXPECT_EQ(Repetitions(nlp::Backend::kNative, 100), 100);
  EXPECT_EQ(Repetitions(nlp::Backend::kIpopt, 100), 10);
  EXPECT_EQ(Repetitions(nlp::Backend::kNlopt, 100), 2);
  EXPECT_EQ(Repetitions(nlp::Backend::kNlopt, 1), 1);
}

TEST(PlanningBenchTest, AnInterruptionKeepsWhatWasFinished) {
  std::atomic<bool> stop = false;
  PlanningBenchOptions options;
  options.scenarios = {Path("tool_use"), Path("stacking")};
  options.solvers = {"native"};
  options.repetitions = 1;
  options.stop = &stop;
  const PlanningBench bench =
      BenchmarkPlanning(options, [&](const ProblemMeasurement& /*problem*/) { stop = true; });
  EXPECT_TRUE(bench.interrupted);
  ASSERT_EQ(bench.problems.size(), 1u);
  EXPECT_EQ(bench.problems.front().title, "Tool Use");
}

TEST(PlanningBenchTest, EveryWrongOptionIsNamed) {
  PlanningBenchOptions options;
  options.repetitions = 0;
  options.solvers = {"native", "natvie"};
  try {
    BenchmarkPlanning(options);
    FAIL();
  } catch (const InputError& error) {
    ASSERT_EQ(error.diagnostics().size(), 2u);
    EXPECT_EQ(error.diagnostics()[0].ToString(), "--repetitions is 0 (a whole number above zero)");
    EXPECT_THAT(error.diagnostics()[1].ToString(),
                HasSubstr("unknown solver 'natvie'; did you mean 'native'?"));
  }
}

TEST(ProcessTimeTest, SpreadIsByNearestRank) {
  EXPECT_EQ(SpreadOf({}).median, 0);
  EXPECT_EQ(SpreadOf({7}).median, 7);
  EXPECT_EQ(SpreadOf({7}).p99, 7);
  std::vector<double> values;
  for (int i = 200; i >= 1; --i) values.push_back(i);
  EXPECT_EQ(SpreadOf(values).median, 100);
  EXPECT_EQ(SpreadOf(values).p99, 198);
}

TEST(ProcessTimeTest, AProcessIsTimedAndItsExitCodeKept) {
  Samples samples;
  EXPECT_EQ(TimeProcess({"sh", "-c", "i=0; while [ $i -lt 2000 ]; do i=$((i+1)); done; exit 3"}, samples), 3);
  EXPECT_EQ(TimeProcess({"sh", "-c", "kill -9 $$"}, samples), 128 + 9);
  ASSERT_EQ(samples.wall.size(), 2u);
  ASSERT_EQ(samples.cpu.size(), 2u);
  EXPECT_GT(samples.wall[0], 0);
  EXPECT_GT(samples.cpu[0], 0);
  EXPECT_THROW(TimeProcess({"/no/such/program"}, samples), InputError);
}

}  // namespace
}  // namespace tether::bench
