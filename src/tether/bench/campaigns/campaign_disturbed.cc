#include "tether/bench/campaigns/campaign_disturbed.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <variant>

#include "tether/bench/campaigns/disturbance.h"
#include "tether/common/text.h"
#include "tether/evaluation/run.h"
#include "tether/robot/model.h"
#include "tether/scenario/perturb.h"
#include "tether/scenario/problem.h"

namespace tether::bench {
namespace {

// A clearance is violated beyond this, m.
constexpr double kViolated = 0.001;
// The speed that a push left is taken back within this time, s.
constexpr double kTakenBack = 0.5;
// What is beyond a limit by less is rounding.
constexpr double kRounding = 1e-6;
// Unintended forces, N, and for how long, s.
constexpr double kNever = 100, kBriefly = 0.05, kSteady = 0.1;

/// Whether a margin is one of those, and by how much it is beyond its limit.
struct Limit {
  const char* name;    ///< Of the limit in records.
  const char* margin;  ///< A part of the margin's name.
};
constexpr Limit kLimits[] = {{"position", "joint limits"},
                             {"velocity", "joint velocity limits"},
                             {"torque", "joint torque limits"},
                             {"torque rate", "joint torque rate limits"}};

// A joint that is pushed with more than its motor has can't be held, whatever is commanded: until its speed
// is taken back, its limits are passed.
bool IsOverpowered(const evaluation::Margin& margin, const robot::Model& model,
                   const std::vector<scenario::Event>& events) {
  if (margin.name != "joint limits" && margin.name != "joint velocity limits") return false;
  return std::any_of(events.begin(), events.end(), [&](const scenario::Event& event) {
    if (margin.time < event.time || margin.time > event.time + event.over + kTakenBack) return false;
    for (Eigen::Index i = 0; i < event.torques.size() && i < model.dof(); ++i) {
      const bool joint = model.joint_names()[static_cast<size_t>(i)] == margin.what;
      if (joint && std::abs(event.torques[i]) > model.max_torque()[i]) return true;
    }
    return false;
  });
}

Value FindViolations(const evaluation::RunReport& run, const robot::Model& model,
                     const std::vector<scenario::Event>& events) {
  Value list = Value::Array();
  const auto add = [&](const std::string& limit, double by, const std::string& what, double time) {
    list.Append(Value::Object().Set("limit", limit).Set("by", by).Set("what", what).Set("time_s", time));
  };
  for (const evaluation::Margin& margin : run.margins) {
    for (const Limit& limit : kLimits) {
      if (margin.name != limit.margin || margin.minimum >= -kRounding) continue;
      const bool avoidable = !IsOverpowered(margin, model, events);
      add(limit.name + std::string(avoidable ? "" : ", unavoidable"), -margin.minimum, margin.what,
          margin.time);
    }
    const bool distance = margin.name.starts_with("clearance") || margin.name == "the arm itself";
    if (!distance || margin.minimum >= -kViolated) continue;
    const bool avoidable = margin.name == "the arm itself" || margin.avoidable < -kViolated;
    add(avoidable ? "clearance" : "clearance, unavoidable", -margin.minimum, margin.name + ": " + margin.what,
        margin.time);
  }
  const evaluation::ForceSummary& forces = run.forces;
  if (forces.most > kNever) add("force above 100 N", forces.most, forces.most_pair, forces.most_time);
  if (forces.longest_50 > kBriefly)
    add("force above 50 N for more than 50 ms", forces.longest_50, forces.most_pair, forces.most_time);
  if (forces.longest_40 > kSteady)
    add("force above 40 N for more than 0.1 s", forces.longest_40, forces.most_pair, forces.most_time);
  return list;
}

}  // namespace

std::optional<Value> MeasureDisturbed(const CampaignScene& scene, const std::atomic<bool>* stop) {
  const std::filesystem::path folder = std::filesystem::path(robot::DataDirectory()) / "scenarios";
  scenario::Scenario scenario = scenario::LoadScenario((folder / (scene.kind + ".yaml")).string());
  const auto task = scenario::MakeTask(scenario);
  scene::Scene start = scenario::PerturbScene(scenario.scene, scenario.perturb, scene.seed);
  scenario::PlanningOverrides overrides;
  overrides.threads = 1;
  overrides.stop = stop;
  overrides.seed = scene.seed;
  const planning::PlanReport planned =
      planning::PlanTask(scenario::MakeProblem(scenario, start, overrides), *task);
  if (planned.status == planning::PlanStatus::kInterrupted) return std::nullopt;
  Value record = Value::Object();
  record.Set("kind", scene.kind).Set("seed", scene.seed).Set("status", planning::ToString(planned.status));
  const planning::CandidateReport* best = planned.best();
  if (best == nullptr) return record.Set("reason", planned.message);

  evaluation::RunOptions options;
  options.seed = scene.seed;
  options.stop = stop;
  Disturbances drawn = DrawDisturbances(scenario, start, best->plan, scene.seed);
  if (drawn.obstacle) scenario::AddObstacle(*drawn.obstacle, start, scenario);
  Value kinds = Value::Array(), events = Value::Array();
  for (const std::string& kind : drawn.kinds) kinds.Append(kind);
  for (const scenario::Event& event : drawn.events)
    events.Append((event.starts.empty() ? Value(event.time).AsText() + " s" : event.starts) + ": " +
                  event.Describe());
  if (drawn.obstacle) {
    const auto& ball = std::get<geometry::Sphere>(drawn.obstacle->object.shape.parts.front().primitive);
    const Eigen::VectorXd p = drawn.obstacle->object.X_ParentObject.p;
    record.Set("obstacle", Value::Object().Set("radius", ball.radius).Set("from", p));
  }
  options.events = std::move(drawn.events);
  record.Set("controller", ToString(scenario.execution.controller))
      .Set("disturbed", kinds)
      .Set("events", events);
  const evaluation::RunReport run = evaluation::RunPlan(scenario, start, *task, best->plan, options);
  if (run.status == evaluation::RunStatus::kInterrupted) return std::nullopt;
  record.Set("run", ToString(run.status)).Set("sim_time_s", run.sim_time_s).Set("retries", run.retries);
  if (!run.reason.empty()) record.Set("run_reason", run.reason);
  return record
      .Set("violations",
           FindViolations(run, *scenario.models.at(scenario::ActingRobot(start)->name), options.events))
      .Set("forces", evaluation::WriteForces(run.forces));
}

Value SummarizeDisturbed(const std::vector<const Value*>& records) {
  struct Passed {
    int runs = 0;
    double most = 0;
    long seed = 0;
  };
  std::map<std::string, Passed> passed;
  int runs = 0, reached = 0, clean = 0;
  double struck = 0;
  for (const Value* record : records) {
    const Value* violations = record->Find("violations");
    if (violations == nullptr) continue;
    ++runs;
    reached += TextOf(*record, "run") == "success" ? 1 : 0;
    struck = std::max(struck, record->Find("forces")->Find("most_of_what_moved_into_the_arm_n")->number());
    std::map<std::string, double> most;
    for (const Value& violation : violations->items()) {
      double& so_far = most[TextOf(violation, "limit")];
      so_far = std::max(so_far, violation.Find("by")->number());
    }
    bool good = true;
    for (const auto& [limit, by] : most) {
      good = good && limit.ends_with("unavoidable");
      Passed& one = passed[limit];
      ++one.runs;
      if (by < one.most) continue;
      one.most = by;
      one.seed = record->Find("seed")->integer();
    }
    clean += good ? 1 : 0;
  }
  Value limits = Value::Array();
  for (const auto& [name, one] : passed) {
    limits.Append(
        Value::Object().Set("limit", name).Set("runs", one.runs).Set("most", one.most).Set("seed", one.seed));
  }
  return Value::Object()
      .Set("runs", runs)
      .Set("reached", reached)
      .Set("within_all_limits", clean)
      .Set("limits_passed", limits)
      .Set("most_of_what_moved_into_the_arm_n", struck);
}

std::string DisturbedText(const Value& row) {
  std::string text = TextOf(row, "runs") + " runs, " + TextOf(row, "within_all_limits") +
                     " within all limits, " + TextOf(row, "reached") + " reach the goal\n";
  for (const Value& limit : row.Find("limits_passed")->items()) {
    text += "  " + TextOf(limit, "limit") + ": " + TextOf(limit, "runs") + " runs, the most by " +
            Fixed(limit.Find("most")->number(), 4) + ", seed " + TextOf(limit, "seed") + "\n";
  }
  return text;
}

}  // namespace tether::bench
