#include "tether/planning/plan/plan_report.h"

#include "tether/common/output/output_header.h"
#include "tether/planning/plan/plan_file.h"

namespace tether::planning {
namespace {

Value Names(const std::vector<std::string>& words) {
  Value list = Value::Array();
  for (const std::string& word : words) list.Append(word);
  return list;
}

}  // namespace

Value WritePlanReport(const PlanReport& report, const std::string& scenario, uint64_t seed) {
  Value plans = Value::Array();
  for (int i : report.BestFirst()) {
    const CandidateReport& candidate = report.candidates[i];
    Value steps = Value::Array();
    for (const PlanStep& step : candidate.plan.steps) steps.Append(WriteStep(step, false));
    Value plan = Value::Object();
    plan.Set("status", ToString(candidate.status)).Set("feasible", candidate.feasible());
    plan.Set("actions", Names(candidate.plan.actions)).Set("cost", candidate.plan.cost);
    plan.Set("max_violation_m", candidate.max_violation_m)
        .Set("max_violation_rad", candidate.max_violation_rad);
    plan.Set("optimize_s", candidate.optimize_s)
        .Set("evaluations", candidate.evaluations)
        .Set("found", i + 1);
    plan.Set("bound", candidate.bound)
        .Set("reason", candidate.reason)
        .Set("blocking", Names(candidate.blocking));
    plan.Set("steps", steps);
    plans.Append(plan);
  }
  Value value = OutputHeader("tether.plan_report/1", seed);
  value.Set("scenario", scenario).Set("status", ToString(report.status)).Set("complete", report.complete);
  value.Set("message", report.message).Set("plans", plans);
  value.Set("timing", Value::Object()
                          .Set("parse_s", report.parse_s)
                          .Set("search_s", report.search_s)
                          .Set("optimize_s", report.optimize_s)
                          .Set("motion_s", report.motion_s)
                          .Set("total_s", report.total_s));
  value.Set("search", Value::Object()
                          .Set("expanded", report.expanded)
                          .Set("generated", report.generated)
                          .Set("needless", report.needless)
                          .Set("other_orders", report.other_orders));
  return value;
}

Value WriteTrace(const PlanReport& report, uint64_t seed) {
  Value candidates = Value::Array();
  for (const CandidateReport& candidate : report.candidates) {
    Value iterations = Value::Array();
    for (const nlp::IterationRecord& record : candidate.trace) {
      iterations.Append(Value::Object()
                            .Set("iteration", record.iteration)
                            .Set("time_s", record.time_s)
                            .Set("cost", record.cost)
                            .Set("violation_m", record.violation_m)
                            .Set("violation_rad", record.violation_rad));
    }
    candidates.Append(
        Value::Object().Set("actions", Names(candidate.plan.actions)).Set("iterations", iterations));
  }
  return OutputHeader("tether.trace/1", seed).Set("candidates", candidates);
}

}  // namespace tether::planning
