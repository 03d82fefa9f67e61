#include "tether/common/output/output_header.h"
#include "tether/evaluation/run.h"
#include "tether/planning/plan/plan_file.h"

namespace tether::evaluation {

std::string ToString(RunStatus status) {
  switch (status) {
    case RunStatus::kNotCalled:
      return "not_called";
    case RunStatus::kSuccess:
      return "success";
    case RunStatus::kGoalMissed:
      return "goal_missed";
    case RunStatus::kFailed:
      return "failed";
    case RunStatus::kTimeout:
      return "timeout";
    case RunStatus::kInterrupted:
      return "interrupted";
  }
  return "not_called";
}

Value WriteRunReport(const RunReport& report, const std::string& scenario, uint64_t seed) {
  Value actions = Value::Array(), steps = Value::Array(), events = Value::Array(), facts = Value::Array();
  for (const std::string& action : report.plan.actions) actions.Append(action);
  for (size_t i = 0; i < report.steps.size() && i < report.plan.steps.size(); ++i) {
    const execution::StepRecord& record = report.steps[i];
    planning::PlanStep executed = report.plan.steps[i];
    executed.X_TC = record.X_TC.value_or(executed.X_TC);
    Value step = planning::WriteStep(executed, false);
    step.Set("start_s", record.start).Set("end_s", record.end).Set("attempts", record.attempts);
    step.Set("position_error_m", record.position_error).Set("rotation_error_rad", record.rotation_error);
    steps.Append(step);
  }
  for (const RunEvent& event : report.events) {
    events.Append(Value::Object()
                      .Set("time_s", event.time)
                      .Set("kind", event.kind)
                      .Set("step", event.step)
                      .Set("text", event.text));
  }
  for (const GoalFact& fact : report.judgement.facts) {
    facts.Append(Value::Object()
                     .Set("atom", fact.atom)
                     .Set("holds", fact.holds)
                     .Set("judged_by", fact.geometric ? "geometry" : "effects")
                     .Set("lapsed", fact.lapsed));
  }
  Value margins = Value::Array();
  for (const Margin& margin : report.margins) margins.Append(WriteMargin(margin));
  Value snapshots = Value::Array();
  for (const std::string& file : report.snapshots) snapshots.Append(file);
  Value value = OutputHeader("tether.run/1", seed);
  value.Set("scenario", scenario).Set("status", ToString(report.status));
  value.Set("goal_reached", report.judgement.goal_reached).Set("reason", report.reason);
  value.Set("sim_time_s", report.sim_time_s).Set("wall_s", report.wall_s).Set("actions", actions);
  value.Set("cost", report.plan.cost).Set("steps", steps).Set("retries", report.retries);
  Value plannings = Value::Array();
  for (const execution::PlanningRecord& one : report.plannings) {
    Value actions_anew = Value::Array();
    for (const std::string& action : one.actions) actions_anew.Append(action);
    Value planning = Value::Object();
    planning.Set("asked_s", one.asked).Set("decision", one.decision).Set("reason", one.reason);
    planning.Set("adopted_s", one.adopted >= 0 ? Value(one.adopted) : Value()).Set("cpu_s", one.cpu);
    planning.Set("actions", actions_anew);
    plannings.Append(planning);
  }
  value.Set("plannings", plannings);
  value.Set("replans", report.replans).Set("goal", facts).Set("events", events).Set("margins", margins);
  value.Set("unintended_forces", WriteForces(report.forces));
  Value poses = Value::Object();
  for (const auto& [object, X_WO] : report.final_X_WO) {
    const Eigen::Quaterniond q(X_WO.R);
    poses.Set(object,
              Value::Object()
                  .Set("position", Eigen::VectorXd(X_WO.p))
                  .Set("quaternion_wxyz", Eigen::VectorXd(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()))));
  }
  value.Set("final_poses", poses).Set("snapshots", snapshots);
  return value;
}

}  // namespace tether::evaluation
