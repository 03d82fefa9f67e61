#include "tether/evaluation/report/run_page.h"

#include <algorithm>
#include <cmath>

#include "tether/common/text.h"
#include "tether/evaluation/report/figure.h"
#include "tether/evaluation/report/page.h"

namespace tether::evaluation {
namespace {

using Rows = std::vector<std::vector<std::string>>;

std::string TextOf(const Value& map, const char* key) {
  const Value* value = map.Find(key);
  return value == nullptr ? "" : value->AsText();
}
double NumberOf(const Value& map, const char* key) {
  const Value* value = map.Find(key);
  return value == nullptr || value->kind() != Value::Kind::kNumber ? std::nan("") : value->number();
}
const std::vector<Value>& ItemsOf(const Value& map, const char* key) {
  static const std::vector<Value> kNone;
  const Value* value = map.Find(key);
  return value == nullptr ? kNone : value->items();
}
std::string Digits(double value, int decimals) {
  return std::isfinite(value) && std::abs(value) < 1e15 ? Fixed(value, decimals) : "";
}

void AddSummary(const RunLog& log, Page& page) {
  Rows rows = {{"scenario", log.Metadata("scenario")},
               {"seed", log.Metadata("seed")},
               {"robot, controller", log.Metadata("robot") + ", " + log.Metadata("controller")},
               {"written by", "tether " + log.Metadata("tether") + ", " + log.Metadata("physics")}};
  if (log.report.is_null()) {
    rows.push_back({"outcome", "not known: the log ends at " + Fixed(log.end, 2) + " s, before the run did"});
  } else {
    const std::string status = TextOf(log.report, "status"), reason = TextOf(log.report, "reason");
    rows.push_back({"outcome", status + (reason.empty() || reason == status ? "" : ": " + reason)});
    rows.push_back({"simulated time", Digits(NumberOf(log.report, "sim_time_s"), 2) + " s"});
    rows.push_back(
        {"retries, changes of plan", TextOf(log.report, "retries") + ", " + TextOf(log.report, "replans")});
  }
  if (log.problem)
    rows.push_back({"the file", log.problem->text + " (byte " + std::to_string(log.problem->offset) + ")"});
  page.AddTable({}, rows);
}

void AddGoal(const RunLog& log, Page& page) {
  Rows rows;
  for (const Value& fact : ItemsOf(log.report, "goal")) {
    const bool holds = TextOf(fact, "holds") == "true", lapsed = TextOf(fact, "lapsed") == "true";
    rows.push_back({TextOf(fact, "atom"),
                    lapsed  ? "held and no longer does"
                    : holds ? "true"
                            : "false",
                    TextOf(fact, "judged_by")});
  }
  if (rows.empty()) return;
  page.AddHeading("Goal");
  page.AddTable({"atom", "at the end", "judged by"}, rows);
}

void AddSteps(const RunLog& log, Page& page) {
  Rows rows;
  for (const Value& step : ItemsOf(log.report, "steps")) {
    const double start = NumberOf(step, "start_s"), end = NumberOf(step, "end_s");
    rows.push_back({TextOf(step, "action"), TextOf(step, "control") + " at " + TextOf(step, "target"),
                    Digits(start, 2), Digits(end, 2), TextOf(step, "attempts"),
                    Digits(1e3 * NumberOf(step, "position_error_m"), 1)});
  }
  if (rows.empty()) return;
  page.AddHeading("Steps");
  page.AddTable({"action", "key pose", "from (s)", "to (s)", "attempts", "off by (mm)"}, rows);
}

/// The least of each series; from the report, if there is one, with the bodies and joints by name.
void AddMargins(const RunLog& log, Page& page) {
  Rows rows;
  for (const Value& margin : ItemsOf(log.report, "margins")) {
    const double least = NumberOf(margin, "minimum");
    // Older logs have 1e300 where nothing was measured.
    if (!(least < 1e200)) continue;
    rows.push_back({TextOf(margin, "name"), Digits(least, 4), TextOf(margin, "unit"),
                    Digits(NumberOf(margin, "time_s"), 2), TextOf(margin, "what")});
  }
  if (log.report.is_null()) {
    for (const LogSeries& series : log.series) {
      if (series.lower != series.upper) continue;
      const auto least = std::min_element(series.values.begin(), series.values.end(), [](double a, double b) {
        return std::isfinite(a) && (!std::isfinite(b) || a < b);
      });
      if (least == series.values.end() || !std::isfinite(*least)) continue;
      const double time = series.times[least - series.values.begin()];
      rows.push_back({series.name, Digits(*least, 4), series.unit, Digits(time, 2), ""});
    }
  }
  if (rows.empty()) return;
  page.AddHeading("Least margins");
  page.AddTable({"margin", "least", "unit", "at (s)", "where"}, rows);
}

void AddEvents(const RunLog& log, Page& page) {
  Rows rows;
  for (const LogEvent& event : log.events)
    rows.push_back({Digits(event.time, 2), event.kind, event.action, event.text});
  if (rows.empty()) return;
  page.AddHeading("What happened");
  page.AddTable({"time (s)", "what", "during", "details"}, rows);
}

}  // namespace

std::string WriteRunPage(const RunLog& log) {
  Page page("Run of " + log.Metadata("scenario"));
  AddSummary(log, page);
  AddGoal(log, page);
  page.AddHeading("Margins and joints over time");
  page.AddFigure(DrawRunLog(log));
  AddMargins(log, page);
  AddSteps(log, page);
  AddEvents(log, page);
  return page.Text();
}

}  // namespace tether::evaluation
