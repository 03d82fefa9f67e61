#include "tether/bench/campaigns/campaign_report.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>

#include "tether/bench/process_time.h"
#include "tether/common/document/value.h"
#include "tether/common/file.h"
#include "tether/common/text.h"
#include "tether/evaluation/report/figure.h"
#include "tether/evaluation/report/page.h"

namespace tether::bench {
namespace {

using Rows = std::vector<std::vector<std::string>>;

constexpr const char* kRecords = "tether.campaign_records/1";
constexpr const char* kSummary = "tether.campaign/1";
constexpr const char* kAccepted = "what tether campaign wrote by --output or --json, or a run's log";

std::string TextOf(const Value& map, const char* key) {
  const Value* value = map.Find(key);
  return value == nullptr ? "" : value->AsText();
}

/// What the records of one kind of scene say.
struct Kind {
  int count = 0;
  std::map<std::string, int> outcomes;
  std::map<std::string, std::vector<double>> numbers;  ///< By name: "plan_cpu_s".
  std::map<std::string, std::vector<double>> margins;  ///< By name and unit.
};

void Take(const Value& record, Kind& kind) {
  ++kind.count;
  const std::string planned = TextOf(record, "status"), run = TextOf(record, "run");
  const std::string outcome = planned + (planned.empty() || run.empty() ? "" : ", ") + run;
  ++kind.outcomes[outcome.empty() ? "not known" : outcome];
  for (const Value::Member& member : record.members()) {
    if (member.key == "seed" || member.key == "blocks" || member.value.kind() != Value::Kind::kNumber)
      continue;
    if (std::isfinite(member.value.number())) kind.numbers[member.key].push_back(member.value.number());
  }
  const Value* margins = record.Find("margins");
  if (margins == nullptr) return;
  for (const Value& margin : margins->items()) {
    const Value* least = margin.Find("minimum");
    if (least != nullptr && least->kind() == Value::Kind::kNumber)
      kind.margins[TextOf(margin, "name") + " (" + TextOf(margin, "unit") + ")"].push_back(least->number());
  }
}

std::string Short(double value) { return Format("%.4g", value); }

std::vector<std::string> SpreadRow(const std::string& kind, const std::string& name,
                                   std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const Spread spread = SpreadOf(values);
  return {kind,
          name,
          std::to_string(values.size()),
          Short(values.front()),
          Short(spread.median),
          Short(spread.p99),
          Short(values.back())};
}

/// One panel per measurement, one line per kind: the share of scenes up to a value.
std::string DrawDistributions(const std::map<std::string, Kind>& kinds, const std::string& caption) {
  std::map<std::string, std::vector<std::pair<std::string, std::vector<double>>>> by_number;
  for (const auto& [kind, of_kind] : kinds) {
    for (const auto& [name, values] : of_kind.numbers) by_number[name].emplace_back(kind, values);
  }
  std::deque<evaluation::LogSeries> lines;
  std::vector<evaluation::FigurePanel> panels;
  for (auto& [name, of_kinds] : by_number) {
    evaluation::FigurePanel panel{"Share of scenes up to " + name, "", "", {}, {}};
    for (auto& [kind, values] : of_kinds) {
      std::sort(values.begin(), values.end());
      evaluation::LogSeries line{kind, "", "", {}, {}, 0, 0};
      for (size_t i = 0; i < values.size(); ++i) {
        // A step at each value.
        for (const size_t share : {i, i + 1}) {
          line.times.push_back(values[i]);
          line.values.push_back(static_cast<double>(share) / static_cast<double>(values.size()));
        }
      }
      lines.push_back(std::move(line));
      panel.series.push_back(&lines.back());
    }
    panels.push_back(std::move(panel));
  }
  return evaluation::DrawFigure(panels, caption);
}

CampaignReport ReportRecords(const Value& header, const std::vector<Value>& records) {
  std::map<std::string, Kind> kinds;
  for (const Value& record : records) Take(record, kinds[TextOf(record, "kind")]);
  const std::string title = "Campaign " + TextOf(header, "name");
  const std::string origin =
      "from seed " + TextOf(header, "seed") + ", by tether " + TextOf(header, "tether");
  CampaignReport report;
  report.svg = DrawDistributions(kinds, title + ", " + origin);
  evaluation::Page page(title);
  page.AddParagraph(std::to_string(records.size()) + " scenes, " + origin);
  Rows outcomes, numbers, margins;
  for (const auto& [name, kind] : kinds) {
    for (const auto& [outcome, count] : kind.outcomes) {
      outcomes.push_back(
          {name, outcome, std::to_string(count), Fixed(100.0 * count / std::max(kind.count, 1), 1) + " %"});
    }
    for (const auto& [number, values] : kind.numbers) numbers.push_back(SpreadRow(name, number, values));
    for (const auto& [margin, values] : kind.margins) margins.push_back(SpreadRow(name, margin, values));
  }
  page.AddHeading("Outcomes");
  page.AddTable({"kind", "outcome", "scenes", "share"}, outcomes);
  const std::vector<std::string> head = {"kind",    "", "scenes", "least", "median", "99th percentile",
                                         "greatest"};
  page.AddHeading("Measurements");
  page.AddTable(head, numbers);
  if (!margins.empty()) {
    page.AddHeading("Least margins of runs");
    page.AddTable(head, margins);
  }
  page.AddHeading("Distributions");
  page.AddFigure(report.svg);
  report.html = page.Text();
  return report;
}

/// Every scalar of a document, by its path.
void Flatten(const Value& value, const std::string& path, Rows& rows) {
  for (const Value::Member& member : value.members())
    Flatten(member.value, path.empty() ? member.key : path + "." + member.key, rows);
  for (size_t i = 0; i < value.items().size(); ++i)
    Flatten(value.items()[i], path + "[" + std::to_string(i) + "]", rows);
  if (value.is_scalar()) rows.push_back({path, value.AsText()});
}

}  // namespace

CampaignReport ReportCampaign(const std::string& path) {
  const std::string text = ReadFile(path);
  const size_t first_end = text.find('\n');
  const auto refuse = [&](int line, const std::string& problem) {
    throw InputError({{Location{path, line, 0}, problem, kAccepted}});
  };
  Value header;
  try {
    header = ParseYaml(std::string_view(text).substr(0, first_end), path);
  } catch (const InputError&) {  // Not a document in one line.
  }
  if (TextOf(header, "format") != kRecords) {
    const Value summary = ParseYaml(text, path);
    const std::string format = TextOf(summary, "format");
    if (format != kSummary)
      refuse(0, format.empty() ? "this is no campaign: it lacks 'format'" : "format is '" + format + "'");
    evaluation::Page page("Campaign " + TextOf(summary, "name"));
    Rows rows;
    Flatten(summary, "", rows);
    page.AddTable({"key", "value"}, rows);
    return {"", page.Text()};
  }
  std::vector<Value> records;
  int line = 1;
  for (size_t begin = first_end + 1; first_end != std::string::npos && begin < text.size();) {
    const size_t end = text.find('\n', begin);
    ++line;
    if (end == std::string::npos) break;  // It was being written when the campaign was ended.
    records.push_back(ParseYaml(std::string_view(text).substr(begin, end - begin), path));
    if (!records.back().is_object()) refuse(line, "this is not a line of a campaign");
    begin = end + 1;
  }
  return ReportRecords(header, records);
}

}  // namespace tether::bench
