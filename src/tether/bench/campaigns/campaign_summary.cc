#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "tether/bench/campaigns/campaign.h"
#include "tether/bench/campaigns/campaign_control.h"
#include "tether/bench/campaigns/campaign_disturbed.h"
#include "tether/bench/campaigns/campaign_execution.h"
#include "tether/bench/process_time.h"
#include "tether/common/output/output_header.h"
#include "tether/common/text.h"

namespace tether::bench {
namespace {

constexpr double kSameCost = 0.01;  // relative

double Number(const Value& record, const char* key, double fallback = 0) {
  const Value* value = record.Find(key);
  return value == nullptr || value->is_null() ? fallback : value->number();
}

std::string Text(const Value& record, const char* key) {
  const Value* value = record.Find(key);
  return value == nullptr ? "" : value->AsText();
}

bool Solved(const Value& record) { return Text(record, "status") == "solved"; }

std::string Percent(double share) { return Fixed(100 * share, 1) + " %"; }

double Share(int part, int whole) {
  return whole == 0 ? 1.0 : static_cast<double>(part) / static_cast<double>(whole);
}

Value TimesOf(const std::vector<double>& times) {
  const Spread spread = SpreadOf(times);
  return Value::Object()
      .Set("median", spread.median)
      .Set("p99", spread.p99)
      .Set("p99_over_median", spread.median > 0 ? spread.p99 / spread.median : 0.0);
}

Value SummarizeRobustness(const std::vector<const Value*>& records) {
  int solved = 0, solvable = 0, ipopt_scenes = 0, ipopt_solved = 0;
  std::vector<double> times, ipopt_times, both_times;
  Value failures = Value::Array();
  for (const Value* record : records) {
    times.push_back(Number(*record, "plan_cpu_s"));
    solved += Solved(*record) ? 1 : 0;
    const Value* can = record->Find("solvable");
    const bool is_solvable = can != nullptr && can->boolean();
    solvable += is_solvable ? 1 : 0;
    if (const Value* ipopt = record->Find("ipopt")) {
      ++ipopt_scenes;
      ipopt_solved += Solved(*ipopt) ? 1 : 0;
      ipopt_times.push_back(Number(*ipopt, "plan_cpu_s"));
      both_times.push_back(times.back());
    }
    if (Solved(*record)) continue;
    Value failure = Value::Object();
    failure.Set("seed", record->Find("seed")->integer());
    if (record->Find("blocks") != nullptr) failure.Set("blocks", record->Find("blocks")->integer());
    failure.Set("status", Text(*record, "status")).Set("reason", Text(*record, "reason"));
    failure.Set("solvable", is_solvable)
        .Set("restart_solved_at", static_cast<int>(Number(*record, "restart_solved_at")));
    failures.Append(failure);
  }
  Value summary = Value::Object();
  summary.Set("solved", solved).Set("solvable", solvable).Set("solved_share", Share(solved, solvable));
  summary.Set("plan_cpu_s", TimesOf(times)).Set("failures", failures);
  if (ipopt_scenes > 0) {
    summary.Set("ipopt", Value::Object()
                             .Set("scenes", ipopt_scenes)
                             .Set("solved", ipopt_solved)
                             .Set("plan_cpu_s", TimesOf(ipopt_times))
                             .Set("native_plan_cpu_s", TimesOf(both_times)));
  }
  return summary;
}

/// How much the plan costs more than the best restart's, relative; infinite if only restarts found one.
double Excess(const Value& record) {
  const double best = Number(record, "restart_cost", std::numeric_limits<double>::infinity());
  if (!Solved(record)) return std::isfinite(best) ? std::numeric_limits<double>::infinity() : 0;
  return std::isfinite(best) ? std::max(0.0, Number(record, "cost") / std::max(best, 1e-9) - 1) : 0;
}

Value SummarizeQuality(const std::vector<const Value*>& records) {
  int within = 0;
  std::vector<double> times, excesses;
  Value worse = Value::Array();
  for (const Value* record : records) {
    times.push_back(Number(*record, "plan_cpu_s"));
    const double excess = Excess(*record);
    excesses.push_back(excess);
    if (excess <= kSameCost) {
      ++within;
      continue;
    }
    Value scene = Value::Object();
    scene.Set("seed", record->Find("seed")->integer());
    if (record->Find("blocks") != nullptr) scene.Set("blocks", record->Find("blocks")->integer());
    scene.Set("status", Text(*record, "status"));
    if (Solved(*record)) scene.Set("cost", Number(*record, "cost"));
    scene.Set("restart_cost", Number(*record, "restart_cost")).Set("excess", excess);
    worse.Append(scene);
  }
  return Value::Object()
      .Set("within_1_percent", within)
      .Set("within_1_percent_share", Share(within, static_cast<int>(records.size())))
      .Set("excess_p99", SpreadOf(excesses).p99)
      .Set("plan_cpu_s", TimesOf(times))
      .Set("worse", worse);
}

Value SummarizeWarm(const std::vector<const Value*>& records) {
  int compared = 0, same = 0, warm_only = 0, cold_only = 0, neither = 0;
  std::vector<double> ratios;
  for (const Value* record : records) {
    const Value *cold = record->Find("cold"), *warm = record->Find("warm");
    if (cold == nullptr || warm == nullptr) continue;
    const bool cold_feasible = cold->Find("feasible")->boolean();
    const bool warm_feasible = warm->Find("feasible")->boolean();
    if (!cold_feasible || !warm_feasible) {
      (cold_feasible ? cold_only : warm_feasible ? warm_only : neither) += 1;
      continue;
    }
    ++compared;
    ratios.push_back(Number(*warm, "cpu_s") / Number(*cold, "cpu_s"));
    same += std::abs(Number(*warm, "cost") / Number(*cold, "cost") - 1) <= kSameCost ? 1 : 0;
  }
  return Value::Object()
      .Set("compared", compared)
      .Set("warm_over_cold_median", SpreadOf(ratios).median)
      .Set("warm_over_cold_p99", SpreadOf(ratios).p99)
      .Set("same_cost", same)
      .Set("same_cost_share", Share(same, compared))
      .Set("only_cold_feasible", cold_only)
      .Set("only_warm_feasible", warm_only)
      .Set("neither_feasible", neither);
}

double Factor(const std::vector<double>& values) {
  if (values.empty()) return 1;
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  return *least > 0 ? *most / *least : 0;
}

Value SummarizeGrowth(const std::vector<const Value*>& records) {
  std::map<int64_t, std::vector<const Value*>> by_blocks;
  for (const Value* record : records) by_blocks[record->Find("blocks")->integer()].push_back(record);
  Value rows = Value::Array();
  bool all_solved = true;
  std::vector<double> planning, solving;
  for (const auto& [blocks, same] : by_blocks) {
    std::vector<double> optimize, solve, optimize_unit, solve_unit;
    int solved = 0;
    for (const Value* record : same) {
      solved += Solved(*record) ? 1 : 0;
      const double unit = Number(*record, "steps") * Number(*record, "live_objects");
      const Value* first = record->Find("first_solve");
      if (unit <= 0 || first == nullptr) continue;
      optimize.push_back(Number(*record, "optimize_cpu_s"));
      solve.push_back(Number(*first, "cpu_s"));
      optimize_unit.push_back(optimize.back() / unit / Number(*record, "candidates", 1));
      solve_unit.push_back(solve.back() / unit);
    }
    all_solved = all_solved && solved == static_cast<int>(same.size());
    planning.push_back(SpreadOf(optimize_unit).median);
    solving.push_back(SpreadOf(solve_unit).median);
    rows.Append(Value::Object()
                    .Set("blocks", blocks)
                    .Set("steps", static_cast<int>(Number(*same.front(), "steps")))
                    .Set("scenes", static_cast<int>(same.size()))
                    .Set("solved", solved)
                    .Set("optimize_cpu_s", SpreadOf(optimize).median)
                    .Set("per_candidate_step_and_object_s", planning.back())
                    .Set("one_solve_cpu_s", SpreadOf(solve).median)
                    .Set("one_solve_per_step_and_object_s", solving.back()));
  }
  return Value::Object()
      .Set("solved", all_solved)
      .Set("sizes", rows)
      .Set("factor", Factor(planning))
      .Set("one_solve_factor", Factor(solving));
}

std::string TimesText(const Value& times) {
  return "median " + Fixed(1e3 * Number(times, "median"), 1) + " ms, p99 " +
         Fixed(1e3 * Number(times, "p99"), 1) + " ms (" + Fixed(Number(times, "p99_over_median"), 1) +
         " times)";
}

std::string SceneText(const Value& scene) {
  const Value* blocks = scene.Find("blocks");
  return "seed " + Text(scene, "seed") + (blocks == nullptr ? "" : ", " + blocks->AsText() + " blocks") +
         ": ";
}

std::string RobustnessText(const Value& row) {
  std::string text = Text(row, "solved") + " solved of " + Text(row, "solvable") + " that can be (" +
                     Percent(Number(row, "solved_share")) + "), " + Text(row, "scenes") + " scenes\n" +
                     "  planning, CPU time: " + TimesText(*row.Find("plan_cpu_s")) + "\n";
  if (const Value* ipopt = row.Find("ipopt")) {
    text += "  IPOPT: " + Text(*ipopt, "solved") + " of " + Text(*ipopt, "scenes") + " solved, " +
            TimesText(*ipopt->Find("plan_cpu_s")) +
            "; on the same scenes, native: " + TimesText(*ipopt->Find("native_plan_cpu_s")) + "\n";
  }
  for (const Value& failure : row.Find("failures")->items()) {
    const bool solvable = failure.Find("solvable")->boolean();
    const std::string at = Text(failure, "restart_solved_at");
    text += "  " + SceneText(failure) +
            (!solvable   ? "no restart solves it"
             : at == "0" ? "IPOPT solves it"
                         : "restart " + at + " solves it") +
            "; " + Text(failure, "reason") + "\n";
  }
  return text;
}

std::string QualityText(const Value& row) {
  std::string text = Text(row, "within_1_percent") + " of " + Text(row, "scenes") +
                     " scenes within 1 % of the best restart (" +
                     Percent(Number(row, "within_1_percent_share")) +
                     ")\n  planning, CPU time: " + TimesText(*row.Find("plan_cpu_s")) + "\n";
  for (const Value& scene : row.Find("worse")->items()) {
    const Value* cost = scene.Find("cost");
    text += "  " + SceneText(scene) +
            (cost == nullptr
                 ? Text(scene, "status")
                 : "cost " + Fixed(cost->number(), 4) + ", " + Percent(Number(scene, "excess")) + " more") +
            "; the best restart's is " + Fixed(Number(scene, "restart_cost"), 4) + "\n";
  }
  return text;
}

std::string WarmText(const Value& row) {
  return Text(row, "compared") + " of " + Text(row, "scenes") +
         " scenes solved both ways; time warm over cold: median " +
         Fixed(Number(row, "warm_over_cold_median"), 2) + ", p99 " +
         Fixed(Number(row, "warm_over_cold_p99"), 2) + "\n  same cost within 1 %: " + Text(row, "same_cost") +
         " (" + Percent(Number(row, "same_cost_share")) +
         "); feasible only cold: " + Text(row, "only_cold_feasible") +
         ", only warm: " + Text(row, "only_warm_feasible") + ", neither: " + Text(row, "neither_feasible") +
         "\n";
}

std::string GrowthText(const Value& row) {
  std::string text =
      "\n  blocks  steps  solved   optimisation (ms)  per step, object (us)   one solve (ms)  per step, "
      "object (us)\n";
  for (const Value& size : row.Find("sizes")->items()) {
    char line[200];
    FormatInto(line, sizeof line, "  %6s  %5s  %6s  %18.1f  %21.1f  %15.1f  %21.1f\n",
               Text(size, "blocks").c_str(), Text(size, "steps").c_str(),
               (Text(size, "solved") + "/" + Text(size, "scenes")).c_str(),
               1e3 * Number(size, "optimize_cpu_s"), 1e6 * Number(size, "per_candidate_step_and_object_s"),
               1e3 * Number(size, "one_solve_cpu_s"), 1e6 * Number(size, "one_solve_per_step_and_object_s"));
    text += line;
  }
  return text + "  largest over smallest per step, object and candidate: " + Fixed(Number(row, "factor"), 2) +
         "; of one solve: " + Fixed(Number(row, "one_solve_factor"), 2) + "\n";
}

}  // namespace

Value SummarizeCampaign(const CampaignOptions& options, const CampaignResult& result) {
  std::vector<std::string> kinds;
  std::map<std::string, std::vector<const Value*>> by_kind;
  for (const Value& record : result.records) {
    const std::string kind = Text(record, "kind");
    if (!by_kind.contains(kind)) kinds.push_back(kind);
    by_kind[kind].push_back(&record);
  }
  Value rows = Value::Array();
  for (const std::string& kind : kinds) {
    const std::vector<const Value*>& records = by_kind[kind];
    const Value summary = options.name == "control"     ? SummarizeControl(records)
                          : options.name == "disturbed" ? SummarizeDisturbed(records)
                          : options.name == "execution" ? SummarizeExecution(records)
                          : options.name == "quality"   ? SummarizeQuality(records)
                          : options.name == "warm"      ? SummarizeWarm(records)
                          : options.name == "growth"    ? SummarizeGrowth(records)
                                                        : SummarizeRobustness(records);
    Value row = Value::Object();
    row.Set("kind", kind).Set("scenes", static_cast<int>(records.size()));
    for (const Value::Member& member : summary.members()) row.Set(member.key, member.value);
    rows.Append(row);
  }
  return OutputHeader("tether.campaign/1", options.seed)
      .Set("name", options.name)
      .Set("restarts", options.restarts)
      .Set("interrupted", result.interrupted)
      .Set("kinds", rows);
}

std::string CampaignTable(const Value& summary) {
  const std::string name = Text(summary, "name");
  std::string text;
  for (const Value& row : summary.Find("kinds")->items()) {
    text += Text(row, "kind") + ": " +
            (name == "control"     ? ControlText(row)
             : name == "disturbed" ? DisturbedText(row)
             : name == "execution" ? ExecutionText(row)
             : name == "quality"   ? QualityText(row)
             : name == "warm"      ? WarmText(row)
             : name == "growth"    ? GrowthText(row)
                                   : RobustnessText(row));
  }
  return text;
}

std::string CampaignLine(int number, int count, const Value& record) {
  const std::string progress = std::to_string(number) + " of " + std::to_string(count);
  if (!Solved(record)) {
    return progress + ": " + Text(record, "kind") + ", " + SceneText(record) + Text(record, "status");
  }
  if (record.Find("run") != nullptr && Text(record, "run") != "success") {
    return progress + ": " + Text(record, "kind") + ", " + SceneText(record) + Text(record, "run") + ", " +
           Text(record, "run_reason");
  }
  return number % 50 == 0 || number == count ? progress : "";
}

}  // namespace tether::bench
