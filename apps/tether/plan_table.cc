#include "apps/tether/plan_table.h"
#include "tether/common/text.h"

namespace tether::app {
namespace {

std::string Join(const std::vector<std::string>& words, const std::string& separator) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : separator) + word;
  return text;
}

std::string Actions(const planning::CandidateReport& candidate) {
  return candidate.plan.actions.empty() ? "nothing to do: the goal is reached at the start"
                                        : Join(candidate.plan.actions, " ");
}

std::string Pad(const std::string& text, size_t width) {
  return text.size() >= width ? text : std::string(width - text.size(), ' ') + text;
}

std::string Status(const planning::CandidateReport& candidate, const Terminal& terminal) {
  const std::string text = Pad(planning::ToString(candidate.status), 10);
  return candidate.feasible() ? terminal.Green(text) : terminal.Red(text);
}

std::string EndLine(const planning::PlanReport& report, const Terminal& terminal) {
  const std::string message = report.message.empty() ? "" : ": " + report.message;
  switch (report.status) {
    case planning::PlanStatus::kSolved:
      return report.complete ? "" : terminal.Yellow("there may be other plans" + message);
    case planning::PlanStatus::kImpossible:
      return terminal.Red("impossible" + message);
    case planning::PlanStatus::kGaveUp:
      return terminal.Red("gave up" + message);
    case planning::PlanStatus::kInterrupted:
      return terminal.Yellow("interrupted; this is what was found so far");
    case planning::PlanStatus::kNotCalled:
      break;
  }
  return "not planned";
}

/// What the steps of a plan take, and how clear of everything the ways to them are; empty: it has no motions.
std::string MotionTable(const planning::Plan& plan, const Terminal& terminal) {
  std::string text;
  double total = 0;
  for (const planning::PlanStep& step : plan.steps) {
    if (!step.motion) continue;
    if (text.empty()) text = terminal.Bold("takes (s)  clear by (mm)  motion of the best plan") + "\n";
    total += step.motion->duration;
    const bool far = step.motion->clearance >= planning::kMostClearance;
    const std::string clear =
        far ? "over " + Fixed(1e3 * planning::kMostClearance, 0) : Fixed(1e3 * step.motion->clearance, 1);
    text += Pad(Fixed(step.motion->duration, 2), 9) + "  " + Pad(clear, 13) + "  " + step.action + "\n";
  }
  return text.empty() ? text : text + Pad(Fixed(total, 2), 9) + "  " + Pad("", 13) + "  in all\n";
}

}  // namespace

std::string CandidateLine(const planning::CandidateReport& candidate, int number, const Terminal& terminal) {
  std::string text = Pad(std::to_string(number), 3) + "  " + Status(candidate, terminal) + "  ";
  if (candidate.feasible()) text += "cost " + Fixed(candidate.plan.cost, 4) + "  ";
  text += Fixed(candidate.optimize_s, 2) + " s  " + Actions(candidate);
  if (!candidate.reason.empty()) text += "\n     " + terminal.Dim(candidate.reason);
  for (const planning::PlanStep& step : candidate.plan.steps) {
    if (candidate.feasible() && !step.face.empty())
      text += "\n     " + terminal.Dim(step.action + ": on " + step.face);
  }
  return text;
}

std::string PlanTable(const planning::PlanReport& report, const Terminal& terminal) {
  std::string text;
  if (!report.candidates.empty()) {
    text += terminal.Bold("rank      cost  violation (mm  mrad)  time (s)      status  actions") + "\n";
  }
  int rank = 0;
  for (int i : report.BestFirst()) {
    const planning::CandidateReport& candidate = report.candidates[i];
    const bool measured = !candidate.plan.steps.empty();
    text += Pad(std::to_string(++rank), 4) + "  " + Pad(measured ? Fixed(candidate.plan.cost, 4) : "-", 8) +
            "  " + Pad(measured ? Fixed(1e3 * candidate.max_violation_m, 3) : "-", 13) + "  " +
            Pad(measured ? Fixed(1e3 * candidate.max_violation_rad, 3) : "-", 6) + "  " +
            Pad(Fixed(candidate.optimize_s, 2), 8) + "  " + Status(candidate, terminal) + "  " +
            Actions(candidate) + "\n";
  }
  if (const planning::CandidateReport* best = report.best()) text += MotionTable(best->plan, terminal);
  text += std::to_string(report.candidates.size()) +
          (report.candidates.size() == 1 ? " candidate, " : " candidates, ") +
          std::to_string(report.expanded) + " states expanded, " + std::to_string(report.generated) +
          " generated; parsing " + Fixed(report.parse_s, 3) + " s, search " + Fixed(report.search_s, 3) +
          " s, optimisation " + Fixed(report.optimize_s, 3) + " s, motion " + Fixed(report.motion_s, 3) +
          " s, in all " + Fixed(report.total_s, 3) + " s";
  const std::string end = EndLine(report, terminal);
  return end.empty() ? text : text + "\n" + end;
}

}  // namespace tether::app
