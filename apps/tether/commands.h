#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tether/bench/campaigns/campaign.h"
#include "tether/scenario/generators/generate.h"
#include "tether/scenario/problem.h"

namespace tether::app {

struct PlanArguments {
  std::string scenario;
  scenario::PlanningOverrides overrides;
  std::string json;    ///< File for the report, or "-"; empty: none.
  std::string output;  ///< File for the best plan; empty: none.
  std::string trace;   ///< File for cost and violation per iteration; empty: none.
};

struct RunArguments {
  std::string scenario;
  std::string plan;              ///< Plan file; empty: plan first.
  std::optional<int> candidate;  ///< Which feasible candidate to run, best first from 1.
  std::string events;            ///< File with disturbances, in place of the scenario's; empty: those.
  bool realtime = false;
  std::string mode = "reactive";  ///< Or servo: the plan is never made anew.
  std::string snapshots;
  std::string json;
  std::string log;  ///< File for the run's log, or "-"; empty: none.
  scenario::PlanningOverrides overrides;
  const std::atomic<bool>* pause = nullptr;  ///< While it is set the arm stands still.
};

struct ReportArguments {
  std::string log;     ///< Log of a run, or a campaign's file.
  std::string output;  ///< SVG or HTML file, or "-".
};

struct CheckArguments {
  std::vector<std::string> files;
};

struct BenchArguments {
  std::string name;
  std::string json;
  // The rest is for benchmark `planning`, as in PlanningBenchOptions.
  std::vector<std::string> scenarios;
  std::vector<std::string> solvers;
  std::optional<int> repetitions;
  bool no_robot = false;
  std::optional<int> ticks;     ///< For benchmark `control`.
  std::optional<double> paced;  ///< s, for benchmark `control`.
  std::string problems;         ///< For benchmark `motion`, as `robot`.
  std::string robot;
  std::string program;  ///< Path of the program itself.
  const std::atomic<bool>* stop = nullptr;
};

struct GenerateArguments {
  std::string kind;  ///< One of GeneratorKinds().
  scenario::GeneratorParameters parameters;
  uint64_t seed = 1;
  std::string output;  ///< Folder for the files.
  bool force = false;  ///< Files that are there already are replaced.
};

struct CampaignArguments {
  bench::CampaignOptions options;
  std::string json;  ///< File for the summary, or "-"; empty: none.
};

struct AutomatonArguments {
  std::string formula;
  std::string semantics = "cosafe";  ///< Or "ltlf".
  bool hoa = false;
  bool dot = false;
  bool summary = false;  ///< Only how many states there are.
  std::string json;      ///< File for the automaton, or "-"; empty: none.
};

/// The commands of the program. Each prints its result and returns the exit code; each throws InputError for
/// bad input.
int PlanCommand(const PlanArguments& arguments);
int RunCommand(const RunArguments& arguments);
int ReportCommand(const ReportArguments& arguments);
int CheckCommand(const CheckArguments& arguments);
int BenchCommand(const BenchArguments& arguments);
int GenerateCommand(const GenerateArguments& arguments);
int CampaignCommand(const CampaignArguments& arguments);
int AutomatonCommand(const AutomatonArguments& arguments);

/// The names of benchmarks, each with one line of explanation.
std::vector<std::pair<std::string, std::string>> BenchNames();

}  // namespace tether::app
