#include "tether/bench/campaigns/campaign_control.h"

#include <algorithm>
#include <map>

#include "tether/bench/process_time.h"
#include "tether/common/text.h"
#include "tether/evaluation/run.h"
#include "tether/math/infinity.h"
#include "tether/scenario/events/obstacle.h"
#include "tether/scenario/perturb.h"
#include "tether/scenario/problem.h"

namespace tether::bench {
namespace {

// Of commands of velocities where the scenario is one of torques, Hz.
constexpr double kVelocityRate = 200;

Value WriteVector(const Eigen::Vector3d& v) {
  Value list = Value::Array();
  for (const double x : v) list.Append(x);
  return list;
}

int Count(const evaluation::RunReport& run, const char* kind) {
  return static_cast<int>(
      std::count_if(run.events.begin(), run.events.end(),
                    [&](const evaluation::RunEvent& event) { return event.kind == kind; }));
}

void WriteRun(const evaluation::RunReport& run, const std::string& obstacle, Value& record) {
  record.Set("run", ToString(run.status)).Set("sim_time_s", run.sim_time_s);
  record.Set("retries", run.retries).Set("detours", Count(run, "detour")).Set("replans", run.replans);
  if (!run.reason.empty()) record.Set("run_reason", run.reason);
  Value margins = Value::Array();
  for (const evaluation::Margin& margin : run.margins) {
    if (margin.minimum == math::kInfinity) continue;
    margins.Append(evaluation::WriteMargin(margin));
    if (margin.name != "clearance to " + obstacle) continue;
    record.Set("obstacle_margin_m", margin.minimum);
    // Where the arm could vacate at all; the same where it always could.
    if (margin.avoidable < math::kInfinity) record.Set("obstacle_margin_avoidable_m", margin.avoidable);
  }
  record.Set("margins", margins).Set("forces", evaluation::WriteForces(run.forces));
}

// Constrained velocities and constrained torques have the same constraints; gains and rates are of one kind.
void SetCommand(const std::string& command, scenario::ExecutionSettings& settings) {
  const scenario::Controller controller = command == "torque" ? scenario::Controller::kConstrainedTorque
                                                              : scenario::Controller::kConstrainedVelocity;
  if (command.empty() || controller == settings.controller) return;
  settings.controller = controller;
  settings.gain.reset();
  settings.damping.reset();
  settings.rate = command == "torque" ? scenario::ExecutionSettings().rate : kVelocityRate;
}

}  // namespace

std::optional<Value> MeasureControl(const CampaignScene& scene, const std::string& path,
                                    const std::string& command, const std::atomic<bool>* stop) {
  scenario::Scenario scenario = scenario::LoadScenario(path);
  SetCommand(command, scenario.execution);
  const auto task = scenario::MakeTask(scenario);
  scene::Scene start = scenario::PerturbScene(scenario.scene, scenario.perturb, scene.seed);
  scenario::PlanningOverrides overrides;
  overrides.threads = 1;
  overrides.stop = stop;
  const planning::Problem problem = scenario::MakeProblem(scenario, start, overrides);
  const Stopwatch clock;
  const planning::PlanReport planned = planning::PlanTask(problem, *task);
  if (planned.status == planning::PlanStatus::kInterrupted) return std::nullopt;
  Value record = Value::Object();
  record.Set("kind", scene.kind).Set("seed", scene.seed);
  record.Set("controller", ToString(scenario.execution.controller));
  record.Set("status", planning::ToString(planned.status)).Set("plan_cpu_s", clock.cpu_s());
  const planning::CandidateReport* best = planned.best();
  if (best == nullptr) return record.Set("reason", planned.message);

  evaluation::RunOptions options;
  options.seed = scene.seed;
  options.stop = stop;
  options.events = scenario.events;
  std::string name;
  if (scene.kind != "seeds") {
    const int actions = static_cast<int>(best->plan.actions.size());
    const auto obstacle = scene.kind == "moved"
                              ? scenario::DrawMovedObstacle(scenario, start, actions, scene.seed)
                              : scenario::DrawCrossingObstacle(scenario, start, actions, scene.seed);
    if (!obstacle) {
      record.Set("status", "not_drawn");
      return record.Set("reason", "no place for an obstacle that leaves the task possible");
    }
    scenario::AddObstacle(*obstacle, start, scenario);
    options.events.push_back(obstacle->event);
    name = obstacle->object.name;
    const Eigen::Vector3d from = obstacle->object.X_ParentObject.p;
    record.Set("obstacle", Value::Object()
                               .Set("from", WriteVector(from))
                               .Set("to", WriteVector(from + obstacle->event.X_by.p))
                               .Set("time_s", obstacle->event.time)
                               .Set("over_s", obstacle->event.over));
  }
  const evaluation::RunReport run = evaluation::RunPlan(scenario, start, *task, best->plan, options);
  if (run.status == evaluation::RunStatus::kInterrupted) return std::nullopt;
  WriteRun(run, name, record);
  return record;
}

Value SummarizeControl(const std::vector<const Value*>& records) {
  int runs = 0, reached = 0, retried = 0, detoured = 0, nearer = 0, avoidable = 0;
  double nearest = math::kInfinity, most_force = 0;
  struct Least {
    double minimum = math::kInfinity;
    std::string unit;
    long seed = 0;
  };
  std::map<std::string, Least> least;
  Value failures = Value::Array();
  for (const Value* record : records) {
    const long seed = record->Find("seed")->integer();
    const bool success = TextOf(*record, "run") == "success";
    runs += record->Find("run") != nullptr ? 1 : 0;
    reached += success ? 1 : 0;
    const auto positive = [&](const char* key) {
      const Value* value = record->Find(key);
      return value != nullptr && value->integer() > 0 ? 1 : 0;
    };
    retried += positive("retries");
    detoured += positive("detours");
    if (const Value* obstacle = record->Find("obstacle_margin_m")) {
      nearest = std::min(nearest, obstacle->number());
      nearer += obstacle->number() < 0 ? 1 : 0;
    }
    if (const Value* obstacle = record->Find("obstacle_margin_avoidable_m"))
      avoidable += obstacle->number() < 0 ? 1 : 0;
    if (const Value* forces = record->Find("forces"))
      most_force = std::max(most_force, forces->Find("most_n")->number());
    if (const Value* margins = record->Find("margins")) {
      for (const Value& margin : margins->items()) {
        Least& so_far = least[TextOf(margin, "name")];
        if (margin.Find("minimum")->number() >= so_far.minimum) continue;
        so_far = {margin.Find("minimum")->number(), TextOf(margin, "unit"), seed};
      }
    }
    if (success) continue;
    const bool ran = record->Find("run") != nullptr;
    failures.Append(Value::Object()
                        .Set("seed", seed)
                        .Set("planned", TextOf(*record, "status") == "solved")
                        .Set("reason", ran ? TextOf(*record, "run") + ": " + TextOf(*record, "run_reason")
                                           : TextOf(*record, "reason")));
  }
  Value margins = Value::Array();
  for (const auto& [name, one] : least) {
    margins.Append(Value::Object()
                       .Set("name", name)
                       .Set("minimum", one.minimum)
                       .Set("unit", one.unit)
                       .Set("seed", one.seed));
  }
  Value summary = Value::Object();
  summary.Set("runs", runs)
      .Set("reached", reached)
      .Set("with_retries", retried)
      .Set("with_detours", detoured);
  if (nearest < math::kInfinity) {
    summary.Set("nearer_than_safe", nearer)
        .Set("nearer_where_it_could_vacate", avoidable)
        .Set("obstacle_margin_m", nearest);
  }
  summary.Set("most_unintended_force_n", most_force);
  return summary.Set("margins", margins).Set("failures", failures);
}

std::string ControlText(const Value& row) {
  std::string text = TextOf(row, "reached") + " of " + TextOf(row, "runs") + " runs reach the goal, " +
                     TextOf(row, "with_retries") + " with retries, " + TextOf(row, "with_detours") +
                     " with detours\n";
  if (const Value* nearest = row.Find("obstacle_margin_m")) {
    text += "  nearer to the obstacle than the safe distance: " + TextOf(row, "nearer_than_safe") +
            " runs, where the arm could vacate: " + TextOf(row, "nearer_where_it_could_vacate") +
            "; least distance less the safe one " + Fixed(1e3 * nearest->number(), 2) + " mm\n";
  }
  text += "  unintended force: at most " + Fixed(row.Find("most_unintended_force_n")->number(), 1) +
          " N\n  least margins:\n";
  for (const Value& margin : row.Find("margins")->items()) {
    const double minimum = margin.Find("minimum")->number();
    const bool metres = TextOf(margin, "unit") == "m";
    text += "    " + TextOf(margin, "name") + ": " +
            (metres ? Fixed(1e3 * minimum, 1) + " mm" : Fixed(minimum, 4) + " " + TextOf(margin, "unit")) +
            ", seed " + TextOf(margin, "seed") + "\n";
  }
  for (const Value& failure : row.Find("failures")->items())
    text += "  seed " + TextOf(failure, "seed") +
            (failure.Find("planned")->boolean() ? ": " : ", not planned: ") + TextOf(failure, "reason") +
            "\n";
  return text;
}

}  // namespace tether::bench
