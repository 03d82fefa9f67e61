#include "tether/bench/campaigns/campaign_execution.h"

#include <algorithm>

#include "tether/bench/process_time.h"
#include "tether/common/text.h"
#include "tether/evaluation/run.h"
#include "tether/planning/check/checker.h"
#include "tether/scenario/generators/generate.h"
#include "tether/scenario/problem.h"

namespace tether::bench {
namespace {

int PosesWithoutIkSolution(const planning::Plan& plan) {
  return static_cast<int>(std::count_if(plan.steps.begin(), plan.steps.end(),
                                        [](const planning::PlanStep& step) { return step.q.size() == 0; }));
}

/// The least clearance of the arm, the hand and what it holds from anything that no step intends to touch.
const evaluation::Margin* LeastClearance(const evaluation::RunReport& run) {
  const evaluation::Margin* least = nullptr;
  for (const evaluation::Margin& margin : run.margins) {
    const bool is_distance = margin.name.starts_with("clearance to ") || margin.name == "the arm itself";
    if (is_distance && (least == nullptr || margin.minimum < least->minimum)) least = &margin;
  }
  return least;
}

// A contact in the simulation is some tenths of a millimetre deep.
constexpr double kTouch = 5e-4;

}  // namespace

std::optional<Value> MeasureExecution(const CampaignScene& scene, bool no_robot,
                                      const std::atomic<bool>* stop) {
  const scenario::Scenario scenario = scenario::LoadGenerated(
      scenario::Generate(scene.kind, {scene.blocks > 0 ? scene.blocks : 3, 6, 2}, scene.seed));
  const auto task = scenario::MakeTask(scenario);
  scenario::PlanningOverrides overrides;
  overrides.threads = 1;
  overrides.no_robot = no_robot;
  overrides.stop = stop;
  const planning::Problem problem = scenario::MakeProblem(scenario, scenario.scene, overrides);
  const Stopwatch clock;
  const planning::PlanReport planned = planning::PlanTask(problem, *task);
  Value record = Value::Object();
  record.Set("kind", scene.kind).Set("seed", scene.seed);
  if (scene.blocks > 0) record.Set("blocks", scene.blocks);
  record.Set("status", planning::ToString(planned.status)).Set("plan_cpu_s", clock.cpu_s());
  if (planned.status == planning::PlanStatus::kInterrupted) return std::nullopt;
  const planning::CandidateReport* best = planned.best();
  if (best == nullptr) return record.Set("reason", planned.message);
  record.Set("cost", best->plan.cost).Set("steps", static_cast<int>(best->plan.steps.size()));
  if (!no_robot) {
    const planning::CheckResult check = planning::CheckPlan(problem, best->plan);
    record.Set("without_witness", PosesWithoutIkSolution(best->plan));
    record.Set("accepted", check.Feasible(problem.program));
  }
  evaluation::RunOptions options;
  options.seed = scene.seed;
  options.stop = stop;
  const evaluation::RunReport run = evaluation::RunPlan(scenario, scenario.scene, *task, best->plan, options);
  if (run.status == evaluation::RunStatus::kInterrupted) return std::nullopt;
  record.Set("run", ToString(run.status)).Set("sim_time_s", run.sim_time_s).Set("retries", run.retries);
  if (!run.reason.empty()) record.Set("run_reason", run.reason);
  if (const evaluation::Margin* least = LeastClearance(run)) {
    record.Set("least_clearance_m", least->minimum)
        .Set("least_clearance", least->name + ", " + least->what + ", at " + Fixed(least->time, 2) + " s");
  }
  return record;
}

Value SummarizeExecution(const std::vector<const Value*>& records) {
  int planned = 0, reached = 0, retried = 0, without_ik_solution = 0, touched = 0;
  std::vector<double> times;
  Value failures = Value::Array(), touching = Value::Array();
  for (const Value* record : records) {
    if (const Value* time = record->Find("plan_cpu_s")) times.push_back(time->number());
    const bool solved = TextOf(*record, "status") == "solved";
    const bool success = TextOf(*record, "run") == "success";
    planned += solved ? 1 : 0;
    reached += success ? 1 : 0;
    const Value* retries = record->Find("retries");
    retried += retries != nullptr && retries->integer() > 0 ? 1 : 0;
    const Value* clearance = record->Find("least_clearance_m");
    const bool touches = clearance != nullptr && clearance->number() < -kTouch;
    touched += touches ? 1 : 0;
    if (touches) {
      touching.Append(Value::Object()
                          .Set("seed", record->Find("seed")->integer())
                          .Set("least_clearance_m", clearance->number())
                          .Set("what", TextOf(*record, "least_clearance")));
    }
    const Value *missing = record->Find("without_witness"), *accepted = record->Find("accepted");
    if ((missing != nullptr && missing->integer() > 0) || (accepted != nullptr && !accepted->boolean()))
      ++without_ik_solution;
    if (success) continue;
    failures.Append(Value::Object()
                        .Set("seed", record->Find("seed")->integer())
                        .Set("planned", solved)
                        .Set("reason", solved ? TextOf(*record, "run") + ": " + TextOf(*record, "run_reason")
                                              : TextOf(*record, "reason")));
  }
  const Spread spread = SpreadOf(times);
  return Value::Object()
      .Set("planned", planned)
      .Set("reached", reached)
      .Set("reached_share", planned == 0 ? 1.0 : static_cast<double>(reached) / planned)
      .Set("with_retries", retried)
      .Set("not_witnessed", without_ik_solution)
      .Set("touched", touched)
      .Set("plan_cpu_s", Value::Object().Set("median", spread.median).Set("p99", spread.p99))
      .Set("failures", failures)
      .Set("touching", touching);
}

std::string ExecutionText(const Value& row) {
  const double share = row.Find("reached_share")->number();
  std::string text =
      TextOf(row, "reached") + " of " + TextOf(row, "planned") + " that were planned reach the goal (" +
      Fixed(100 * share, 1) + " %), " + TextOf(row, "scenes") + " scenes; " + TextOf(row, "with_retries") +
      " with retries, " + TextOf(row, "not_witnessed") + " with key poses without an IK solution, " +
      TextOf(row, "touched") + " with something touched that no step intends\n  planning, CPU time: median " +
      Fixed(1e3 * row.Find("plan_cpu_s")->Find("median")->number(), 1) + " ms, p99 " +
      Fixed(1e3 * row.Find("plan_cpu_s")->Find("p99")->number(), 1) + " ms\n";
  for (const Value& failure : row.Find("failures")->items())
    text += "  seed " + TextOf(failure, "seed") +
            (failure.Find("planned")->boolean() ? ": " : ", not planned: ") + TextOf(failure, "reason") +
            "\n";
  for (const Value& touch : row.Find("touching")->items()) {
    text += "  seed " + TextOf(touch, "seed") +
            " touches: " + Fixed(1e3 * touch.Find("least_clearance_m")->number(), 1) + " mm, " +
            TextOf(touch, "what") + "\n";
  }
  return text;
}

}  // namespace tether::bench
